//! What a person does to scans that are open, other than looking: corrects where their samples lie, names them, and puts them in order.

use crate::compare::compared;
use crate::opened::Opened;
use crate::source::Source;
use bregma_field::{Correction, GridError, Volume};
use glam::DAffine3;
use std::sync::Arc;

impl Source {
    /// `volume` as the person named and turned it, whatever its samples: a finer one than it was done to, too. Its spacing is its own.
    pub fn dress(&self, volume: &Arc<Volume>) -> Arc<Volume> {
        if self.called.is_none() && self.turn.is_none() {
            return Arc::clone(volume);
        }
        let turned = volume.corrected(Correction { turn: self.turn, ..volume.placing().correction() });
        // A turn of a grid is a grid.
        turned.map_or_else(|_| Arc::clone(volume), |turned| Arc::new(turned.renamed(&self.name())))
    }
}

impl Opened {
    /// Puts scan number `n` where `correction` has it, instead of an earlier one. Gives what of the world was moved by that: what lay on the scan
    /// lies on it again there. It fails where that is no grid.
    pub fn correct(&mut self, n: usize, correction: Correction) -> Result<DAffine3, GridError> {
        let volume = self.volumes[n].corrected(correction)?;
        let taken = volume.placing().correction();
        (self.sources[n].spacing_mm, self.sources[n].turn) = (taken.spacing_mm, taken.turn);
        let registered = self.scene.layers[n].transform;
        let from = registered * self.volumes[n].grid().index_to_world();
        let moved = registered * volume.grid().index_to_world() * from.inverse();
        if let Some(labelled) = &self.sources[n].labels {
            // A map that is in a file lies where the scan lay then.
            self.sources[n].labels = Some(labelled.on(&volume));
            self.sources[n].within = None;
        }
        self.volumes[n] = Arc::new(volume);
        Ok(moved)
    }

    /// Calls scan number `n` by another name; by its file's where that is empty.
    pub fn rename(&mut self, n: usize, name: &str) {
        let name: String = name.chars().filter(|c| !c.is_control()).collect();
        let name = name.trim();
        self.sources[n].called = Some(name.to_owned()).filter(|name| !name.is_empty() && *name != self.sources[n].file_name());
        let before = self.volumes[n].name().to_owned();
        self.volumes[n] = Arc::new(self.volumes[n].renamed(&self.sources[n].name()));
        // Kept registrations know their scans by name.
        let names = self.poses.iter_mut().flat_map(|pose| [&mut pose.scan, &mut pose.onto]);
        names.filter(|name| **name == before).for_each(|name| *name = self.volumes[n].name().to_owned());
    }

    /// Closes scan number `n`: later ones are counted one lower, and a cut of it alone goes with it.
    pub fn close(&mut self, n: usize) {
        if n < self.sources.len() {
            self.sources.remove(n);
        }
        self.volumes.remove(n);
        self.scene.layers.remove(n);
        self.scene.clips.retain_mut(|clip| {
            let Some(layers) = &mut clip.layers else { return true };
            layers.retain(|layer| *layer != n);
            layers.iter_mut().filter(|layer| **layer > n).for_each(|layer| *layer -= 1);
            !layers.is_empty()
        });
        let kept = self.pair.filter(|pair| !pair.contains(&n));
        self.pair = kept.map(|pair| pair.map(|other| other - usize::from(other > n)));
    }

    /// The same with these scans alone, in their order.
    pub fn only(&self, scans: &[usize]) -> Self {
        let mut own = self.clone();
        (0..self.volumes.len()).rev().filter(|n| !scans.contains(n)).for_each(|n| own.close(n));
        own
    }

    /// Lets two scans change places. Each keeps its colour, its cuts and all else that belongs to it.
    pub fn swap(&mut self, a: usize, b: usize) {
        self.sources.swap(a, b);
        self.volumes.swap(a, b);
        self.scene.layers.swap(a, b);
        let swapped = |n: usize| {
            if n == a {
                b
            } else if n == b {
                a
            } else {
                n
            }
        };
        self.scene.clips.iter_mut().filter_map(|clip| clip.layers.as_mut()).flatten().for_each(|n| *n = swapped(*n));
        self.pair.iter_mut().flatten().for_each(|n| *n = swapped(*n));
    }

    /// The two scans that are compared, if there are two.
    pub fn compared(&self) -> Option<[usize; 2]> {
        compared(&self.scene, self.pair)
    }

    /// Puts scan number `from` in place `to` of the list; those between move by one.
    pub fn carry(&mut self, from: usize, to: usize) {
        if from < to {
            (from..to).for_each(|n| self.swap(n, n + 1));
        } else {
            (to..from).rev().for_each(|n| self.swap(n, n + 1));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::session_file::Session;
    use bregma_field::{Clip, IndexPoint, Shape, Turn};
    use glam::DVec3;
    use std::path::Path;

    fn pair() -> Opened {
        Opened::demo(16, &Default::default()).unwrap()
    }

    #[test]
    fn cuts_follow_their_volumes_when_one_is_closed() {
        // Fails if a cut of the second volume cuts another one after the first is gone, or outlives the only one that it cuts.
        let mut opened = pair();
        let third = opened.clone();
        opened.add(third);
        let plane = Clip::all(Shape::Plane { normal: DVec3::Z, offset_mm: 0.0 });
        let of = |layers: &[usize]| Clip { layers: Some(layers.to_vec()), ..plane.clone() };
        opened.scene.clips = vec![plane.clone(), of(&[0]), of(&[0, 2]), of(&[1])];
        let alone = opened.only(&[2]);
        opened.close(0);
        assert_eq!(opened.scene.clips.iter().map(|c| c.layers.clone()).collect::<Vec<_>>(), [None, Some(vec![1]), Some(vec![0])]);
        assert!(opened.volumes.len() == 3 && alone.volumes.len() == 1 && alone.sources.len() == 1);
        assert_eq!(alone.scene.clips.iter().map(|c| c.layers.clone()).collect::<Vec<_>>(), [None, Some(vec![0])]);
    }

    #[test]
    fn what_lies_on_a_scan_lies_on_it_when_it_is_corrected() {
        // Fails if a landmark stays behind when its scan is turned or its spacing corrected, registered or not, or if a sample is copied.
        let mut opened = pair();
        opened.scene.layers[1].transform = DAffine3::from_rotation_y(0.3) * DAffine3::from_translation(DVec3::new(5.0, -3.0, 2.0));
        let at = IndexPoint(DVec3::new(3.0, 5.5, 7.0));
        let place = |opened: &Opened| opened.scene.layers[1].transform.transform_point3(opened.volumes[1].grid().world(at).0);
        let (before, volume) = (place(&opened), Arc::clone(&opened.volumes[1]));
        let spacing_mm = Some(volume.grid().spacing_mm() * DVec3::new(1.0, 1.5, 2.0));
        let moved = opened.correct(1, Correction { spacing_mm, turn: "PLI".parse().unwrap() }).unwrap();
        assert!((moved.transform_point3(before) - place(&opened)).length() < 1e-9);
        assert_eq!(opened.volumes[1].samples_id(), volume.samples_id());
        assert_eq!((opened.sources[1].spacing_mm, opened.sources[1].turn.to_string()), (spacing_mm, "PLI".to_owned()));
        assert_eq!(opened.corrections().len(), 2, "{:?}", opened.corrections());
        // Back again.
        opened.correct(1, Correction::default()).unwrap();
        assert!(opened.corrections().is_empty() && opened.volumes[1].grid() == volume.grid() && opened.sources[1].spacing_mm.is_none());
        assert!(opened.correct(0, Correction { spacing_mm: Some(DVec3::ZERO), turn: Turn::default() }).is_err());
    }

    #[test]
    fn names_and_order_are_kept_in_the_session() {
        // Fails if a session forgets what a scan is called, how it lies, or which is the first; or if a cut goes over to another scan.
        let mut opened = pair();
        opened.scene.clips.push(Clip { layers: Some(vec![0]), ..Clip::all(Shape::Plane { normal: DVec3::X, offset_mm: 1.0 }) });
        let color = opened.scene.layers[0].color;
        opened.rename(0, "  before\nsurgery ");
        opened.rename(1, "");
        let spacing_mm = Some(DVec3::new(1.0, 2.0, 3.0));
        opened.correct(0, Correction { spacing_mm, turn: "RPS,mirror".parse().unwrap() }).unwrap();
        opened.swap(0, 1);
        assert_eq!(opened.scene.clips[0].layers, Some(vec![1]));
        assert_eq!((opened.volumes[1].name(), opened.scene.layers[1].color), ("beforesurgery", color));
        let folder = std::env::temp_dir().join(format!("bregma-arrange-{}", std::process::id()));
        std::fs::create_dir_all(&folder).unwrap();
        let file = folder.join("pair.json");
        Session::of(&opened, Path::new(".")).write(&file).unwrap();
        let again = Opened::read(&[Source { file, ..Source::default() }], &Default::default()).unwrap();
        assert_eq!(again.volumes.iter().map(|v| v.name()).collect::<Vec<_>>(), ["skull B", "beforesurgery"]);
        assert_eq!((again.volumes[1].content(), again.corrections()), (opened.volumes[1].content(), opened.corrections()));
        // Files that know the scan by its file's name still find it.
        let mut again = again;
        std::fs::write(folder.join("l.csv"), "name,x_mm,y_mm,z_mm,scan\nn,1,2,3,skull A\nm,1,2,3,nobody\n").unwrap();
        again.take_landmarks(&folder.join("l.csv")).unwrap();
        assert_eq!(again.landmarks.iter().map(|l| l.scan.as_deref()).collect::<Vec<_>>(), [Some("beforesurgery"), None]);
        let pairs = r#"{"pairs": {"skull A->skull B": {"R": [[1,0,0],[0,1,0],[0,0,1]], "t": [0,0,7]}}}"#;
        std::fs::write(folder.join("pairs.json"), pairs).unwrap();
        assert_eq!(again.register(&folder.join("pairs.json")).unwrap(), 1);
        std::fs::remove_dir_all(folder).unwrap();
    }

    #[test]
    fn a_scan_is_carried_past_others() {
        // Fails if those that it passes change their order, or if a cut or a colour stays in its place.
        let mut opened = pair();
        opened.sources.push(opened.sources[0].clone());
        opened.volumes.push(Arc::new(opened.volumes[0].renamed("C")));
        opened.scene.layers.push(opened.scene.layers[0].clone());
        opened.scene.clips.push(Clip { layers: Some(vec![0]), ..Clip::all(Shape::Plane { normal: DVec3::X, offset_mm: 1.0 }) });
        let color = opened.scene.layers[0].color;
        let names = |opened: &Opened| opened.volumes.iter().map(|v| v.name().to_owned()).collect::<Vec<_>>();
        opened.carry(0, 2);
        assert_eq!((names(&opened), opened.scene.layers[2].color), (["skull B", "C", "skull A"].map(String::from).to_vec(), color));
        assert_eq!(opened.scene.clips[0].layers, Some(vec![2]));
        opened.carry(2, 0);
        assert_eq!(names(&opened), ["skull A", "skull B", "C"]);
        opened.carry(2, 1);
        opened.carry(1, 1);
        assert_eq!(
            (names(&opened), opened.scene.clips[0].layers.clone()),
            (["skull A", "C", "skull B"].map(String::from).to_vec(), Some(vec![0]))
        );
    }
}
