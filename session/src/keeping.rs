//! Registrations that are kept: of which scans they are, which of them stands, and what they are written as.

use crate::opened::Opened;
use crate::poses::KeptPose;
use crate::register::{Order, Registered, Report, SAME_POSE_MM};
use bregma_field::{Registration, TransformError, write_transform};
use bregma_renderer::Named;
use serde_json::{Map, Value, json};
use std::path::Path;

/// How a registration came about.
#[derive(Clone, Debug)]
pub enum Made {
    /// By a fit.
    Fit(Box<(Order, Registered)>),
    /// By hand.
    ByHand,
    /// The scan was opened so, or a file moved it.
    Given,
}

impl Made {
    /// What registrations of its kind are called, before their number.
    fn word(&self) -> String {
        match self {
            Self::Fit(fit) => {
                let mut letters = fit.0.by.name().chars();
                letters.next().into_iter().flat_map(char::to_uppercase).chain(letters).collect()
            }
            Self::ByHand => "By hand".into(),
            Self::Given => "As it lay".into(),
        }
    }

    fn record(&self) -> Map<String, Value> {
        match self {
            Self::Fit(fit) => Map::from_iter([("method".into(), json!(fit.0)), ("report".into(), json!(fit.1.report))]),
            Self::ByHand => Map::from_iter([("method".into(), json!({ "by": "hand" }))]),
            Self::Given => Map::new(),
        }
    }
}

impl Opened {
    /// Keeps how scan number `moving` lies against number `fixed`, under the next free name, and gives its number among all that are kept. What
    /// a fit left out of the scene, as where the fixed scan is stretched, is kept with it.
    pub fn keep(&mut self, [moving, fixed]: [usize; 2], made: &Made) -> usize {
        let (layer, back) = (&self.scene.layers[moving], self.scene.layers[fixed].transform.inverse());
        let registration = match made {
            Made::Fit(fit) => fit.1.registration.clone(),
            Made::ByHand | Made::Given => Registration {
                transform: back * layer.transform,
                residual_mm: layer.residual_mm,
                covariance: layer.covariance.as_ref().and_then(|covariance| covariance.moved(&back)),
            },
        };
        let [scan, onto] = [moving, fixed].map(|n| self.volumes[n].name().to_owned());
        let Registration { transform, residual_mm, covariance } = registration;
        let name = self.free_name(&scan, &made.word());
        self.poses.push(KeptPose { name, scan, onto, transform, residual_mm, covariance, record: made.record() });
        self.poses.len() - 1
    }

    fn free_name(&self, scan: &str, word: &str) -> String {
        let is_free = |name: &String| !self.poses.iter().any(|pose| pose.scan == scan && pose.name == *name);
        (1..).map(|n| format!("{word} {n}")).find(is_free).unwrap_or_default()
    }

    /// The numbers of those that are kept of a pair.
    pub fn poses_of(&self, [moving, fixed]: [usize; 2]) -> Vec<usize> {
        let [scan, onto] = [moving, fixed].map(|n| self.volumes[n].name());
        (0..self.poses.len()).filter(|k| self.poses[*k].scan == scan && self.poses[*k].onto == onto).collect()
    }

    /// What the moving scan's layer takes of one that is kept, where the fixed scan lies as it does.
    pub fn posed(&self, pose: &KeptPose, fixed: usize) -> Registration {
        let registered = Registered { registration: pose.registration(), report: Report::default() };
        registered.in_scene(&self.scene.layers[fixed])
    }

    /// Whether the scan lies as one that is kept has it, but for rounding.
    pub fn stands(&self, pose: &KeptPose, [moving, fixed]: [usize; 2]) -> bool {
        let (is, kept) = (self.scene.layers[moving].transform, self.posed(pose, fixed).transform);
        let corners = self.volumes[moving].grid().corners_mm();
        corners.into_iter().all(|p| is.transform_point3(p).distance(kept.transform_point3(p)) <= SAME_POSE_MM)
    }
}

impl KeptPose {
    /// Writes it in the form that the name of `file` asks for.
    pub fn write(&self, file: &Path) -> Result<(), TransformError> {
        write_transform(file, Some([self.scan.as_str(), self.onto.as_str()]), &self.registration(), self.record.clone())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use bregma_field::Covariance;
    use glam::{DAffine3, DVec3};

    #[test]
    fn what_is_kept_goes_along_with_the_scan_that_stays() {
        // Fails if a kept registration is one in the scene's world, is told to stand where it does not, loses how sure it is, there or in a
        // file, or stays with an old name.
        let mut opened = Opened::demo(16, &Default::default()).unwrap();
        opened.scene.layers[0].transform = DAffine3::from_rotation_z(0.3);
        let own = DAffine3::from_rotation_x(0.1) * DAffine3::from_translation(DVec3::new(3.0, 4.0, 5.0));
        opened.scene.layers[1].transform = opened.scene.layers[0].transform * own;
        let mut matrix = [[0.0; 6]; 6];
        matrix[3][3] = 0.25;
        opened.scene.layers[1].covariance = Some(Covariance { centre_mm: DVec3::X * 7.0, matrix, undetermined: vec![] });
        let (layer, numbers) = (opened.scene.layers[1].clone(), [1, 0]);
        let k = opened.keep(numbers, &Made::Given);
        assert_eq!((k, opened.poses[k].name.as_str()), (0, "As it lay 1"));
        assert!(opened.poses[k].transform.abs_diff_eq(own, 1e-12) && opened.stands(&opened.poses[k], numbers));
        let posed = opened.posed(&opened.poses[k], 0);
        assert!(posed.transform.abs_diff_eq(layer.transform, 1e-12));
        let sure = |c: &Option<Covariance>| c.as_ref().unwrap().variance_at(DVec3::ZERO, DVec3::X);
        assert!((sure(&posed.covariance) - sure(&layer.covariance)).abs() < 1e-12 && sure(&layer.covariance) == 0.25);
        // Moved together they lie on each other as before; alone they do not.
        opened.scene.layers.iter_mut().for_each(|l| l.transform = DAffine3::from_translation(DVec3::Y * 90.0) * l.transform);
        assert!(opened.stands(&opened.poses[k], numbers));
        opened.scene.layers[0].transform = DAffine3::IDENTITY;
        assert!(!opened.stands(&opened.poses[k], numbers));
        opened.scene.layers[1].covariance = None;
        let k = opened.keep(numbers, &Made::ByHand);
        assert_eq!((opened.poses[k].name.as_str(), &opened.poses[k].record["method"]["by"]), ("By hand 1", &json!("hand")));
        assert_eq!(opened.keep(numbers, &Made::ByHand), 2);
        assert_eq!(opened.poses[2].name, "By hand 2");
        // What is written is read again, and says how it was made.
        let file = std::env::temp_dir().join(format!("bregma-keeping-{}.json", std::process::id()));
        opened.poses[0].write(&file).unwrap();
        let read = bregma_field::read_transform(&file, opened.volumes[1].name(), &[opened.volumes[0].name()]).unwrap();
        assert_eq!(read, opened.poses[0].registration());
        opened.poses[1].write(&file).unwrap();
        assert!(std::fs::read_to_string(&file).unwrap().contains(r#""by": "hand""#));
        std::fs::remove_file(file).unwrap();
        opened.rename(1, "another");
        assert_eq!((opened.poses_of(numbers), opened.poses_of([0, 1])), (vec![0, 1, 2], vec![]));
    }
}
