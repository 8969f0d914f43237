//! What landmarks tell of sides: names of left and right exchanged, a mirror image, axes that point the other way.

use crate::landmarks::{Freedom, LandmarkFit, rms, transform};
use crate::motion::turn_deg;
use glam::{DAffine3, DMat3, DVec3};
use std::collections::BTreeMap;

/// A fit that is so much better is no chance: less than seven tenths of the residual.
const CLEARLY_BETTER: f64 = 0.7;

/// Says where names with left and right exchanged, or a mirror image, fit better, and where the pose is one that mixed axes make.
pub(crate) fn notes(fit: &LandmarkFit, used: &[[DVec3; 2]], freedom: Freedom) -> Vec<String> {
    let point_of: BTreeMap<&str, DVec3> = fit.pairs.iter().filter(|p| p.used).map(|p| (p.name.as_str(), p.fixed_mm)).collect();
    let exchanged: Vec<[DVec3; 2]> = fit
        .pairs
        .iter()
        .filter(|p| p.used)
        .map(|p| [p.moving_mm, other_side(&p.name).and_then(|name| point_of.get(name.as_str()).copied()).unwrap_or(p.fixed_mm)])
        .collect();
    let better = |pairs: &[[DVec3; 2]]| {
        let (pose, _) = transform(pairs, freedom);
        let found = rms(pairs, &pose);
        (found < CLEARLY_BETTER * fit.rms_mm).then_some(found)
    };
    let mirrored: Vec<[DVec3; 2]> = used.iter().map(|[x, y]| [*x * DVec3::new(-1.0, 1.0, 1.0), *y]).collect();
    let mut notes = vec![];
    if exchanged != used
        && let Some(found) = better(&exchanged)
    {
        notes.push(format!(
            "left and right seem exchanged in one scan: with the names of the sides exchanged {found:.3} mm are left, not {:.3}",
            fit.rms_mm
        ));
    } else if let Some(found) = better(&mirrored) {
        notes.push(format!("one scan seems to be a mirror image: mirrored, {found:.3} mm are left, not {:.3}", fit.rms_mm));
    }
    notes.extend(half_turn(&fit.pose));
    notes
}

/// How far a turn may be from half a turn about S: scans of one scanner lie alike to that, but for how a head is held.
const HALF_TURN_DEG: f64 = 25.0;

/// Where a pose turns a scan by about half about S, as it does where x and y of one list are negated.
fn half_turn(pose: &DAffine3) -> Option<String> {
    let about_s = DMat3::from_diagonal(DVec3::new(-1.0, -1.0, 1.0));
    // Without the scale, if there is one.
    let turn = pose.matrix3 * pose.matrix3.determinant().abs().cbrt().recip();
    let is_half = turn_deg(turn * about_s) < HALF_TURN_DEG;
    is_half.then(|| {
        "the scan is turned by half about S: where it was not scanned facing backward, one list of landmarks is in RAS and is taken for LPS; \
         `.mrk.json` and `.fcsv` state which they are"
            .into()
    })
}

/// The name of the same point on the other side, where a word of the name is a side.
fn other_side(name: &str) -> Option<String> {
    const SIDES: [[&str; 2]; 6] = [["left", "right"], ["Left", "Right"], ["LEFT", "RIGHT"], ["L", "R"], ["l", "r"], ["sin", "dex"]];
    let is_letter = |c: Option<char>| c.is_some_and(char::is_alphabetic);
    SIDES.iter().flat_map(|[a, b]| [[a, b], [b, a]]).find_map(|[from, to]| {
        let mut places = name.match_indices(*from).map(|(at, _)| at);
        let at = places.find(|at| {
            let (before, behind) = (name[..*at].chars().next_back(), name[at + from.len()..].chars().next());
            !is_letter(before) && !is_letter(behind)
        })?;
        Some(format!("{}{to}{}", &name[..at], &name[at + from.len()..]))
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::landmarks::fit;
    use crate::landmarks::tests::{SCANS, named, noise, random_points, some_pose};
    use bregma_synthetic::Random;

    #[test]
    fn sides_exchanged_and_mirror_images_are_said() {
        // Fails if names of sides are not found in how people write them, a mirrored scan passes, or a sound list is suspected.
        let mut random = Random(4);
        let half = random_points(&mut random, 5);
        let mirror = |p: &DVec3| *p * DVec3::new(-1.0, 1.0, 1.0);
        let styles = [
            ["po-L", "po-R"],
            ["Orbitale left", "Orbitale right"],
            ["l. zygion", "r. zygion"],
            ["ZYG_L", "ZYG_R"],
            ["porion sin.", "porion dex."],
        ];
        let mut points: Vec<DVec3> = half.iter().flat_map(|p| [*p, mirror(p)]).collect();
        let mut names: Vec<&str> = styles.iter().flatten().copied().collect();
        points.extend([DVec3::new(0.0, 60.0, 5.0), DVec3::new(0.0, -50.0, 30.0), DVec3::new(0.0, 0.0, 66.0)]);
        names.extend(["nasion", "opisthion", "Lambda"]);
        let pose = some_pose(&mut random);
        let moved: Vec<DVec3> = points.iter().map(|p| pose.transform_point3(*p) + noise(&mut random, 0.5)).collect();
        let notes = |moved: &[DVec3], names_b: &[&str]| {
            fit(&named(&points, &names), &named(moved, names_b), SCANS, Freedom::Rigid, &[]).unwrap().notes.join("; ")
        };
        assert_eq!(notes(&moved, &names), "");
        let exchanged: Vec<String> = names.iter().map(|n| other_side(n).unwrap_or_else(|| (*n).to_owned())).collect();
        let exchanged: Vec<&str> = exchanged.iter().map(String::as_str).collect();
        assert!(notes(&moved, &exchanged).contains("left and right seem exchanged"), "{}", notes(&moved, &exchanged));
        let one_sided: Vec<DVec3> = random_points(&mut random, 9);
        let mirrored: Vec<DVec3> = one_sided.iter().map(|p| mirror(p) + noise(&mut random, 0.5)).collect();
        let fit = fit(&named(&one_sided, &[]), &named(&mirrored, &[]), SCANS, Freedom::Rigid, &[]).unwrap();
        assert!(fit.notes.join("; ").contains("mirror image"), "{:?}", fit.notes);
    }

    #[test]
    fn lists_of_unlike_axes_are_said() {
        // Fails if a list in RAS against one in LPS, which a half turn fits with nothing left, passes without a word; or a head held 20° askew does not.
        let mut random = Random(12);
        let points = random_points(&mut random, 6);
        let list = |map: DMat3| named(&points.iter().map(|p| map * *p + DVec3::new(3.0, -40.0, 12.0)).collect::<Vec<_>>(), &[]);
        let held = DMat3::from_axis_angle(DVec3::new(0.8, -0.6, 0.0), 20.0_f64.to_radians());
        let flip = DMat3::from_diagonal(DVec3::new(-1.0, -1.0, 1.0));
        let said = |of: DMat3| {
            let found = fit(&list(DMat3::IDENTITY), &list(of), SCANS, Freedom::Rigid, &[]).unwrap();
            assert!(found.rms_mm < 1e-9, "nothing is left: {}", found.rms_mm);
            found.notes.iter().any(|note| note.contains("RAS"))
        };
        assert!(said(flip) && said(flip * held) && !said(DMat3::IDENTITY) && !said(held));
    }
}
