//! Volumes of bone and of cavities in the window.

use super::*;

/// A hollow ball of radii 8 and 12 mm with a hole of 2 mm at its top, in a box of 34 mm, as an NRRD file.
fn hollow(name: &str) -> std::path::PathBuf {
    const N: usize = 68;
    let file = std::env::temp_dir().join(format!("bregma-window-{}-{name}.nrrd", std::process::id()));
    let mut bytes =
        format!("NRRD0004\ntype: float\ndimension: 3\nsizes: {N} {N} {N}\nspacings: 0.5 0.5 0.5\nencoding: raw\nendian: little\n\n")
            .into_bytes();
    let at = |n: usize| 0.5 * (n as f32 - 33.5);
    for n in 0..N * N * N {
        let [x, y, z] = [at(n % N), at(n / N % N), at(n / N / N)];
        let shell = 2.0 - ((x * x + y * y + z * z).sqrt() - 10.0).abs();
        let hole = if z > 0.0 { (x * x + y * y).sqrt() - 2.0 } else { 10.0 };
        bytes.extend((100.0 * shell.min(hole)).to_le_bytes());
    }
    std::fs::write(&file, bytes).unwrap();
    file
}

#[test]
fn a_leaking_cavity_gets_a_lid_and_its_volume() {
    // Fails if bone has no volume, a leak is told as a volume or not at all, the lid does not close it, or what was measured is not kept.
    let file = hollow("hollow");
    let slider = format!("Isovalue of {}", file.file_name().unwrap().display());
    let mut window = open(Start::Files(vec![bregma_session::Source { file, ..Default::default() }]));
    wait(&mut window, "the scan", |w| !w.is_loading());
    window.get_by_role_and_label(Role::Slider, &slider).set_value_accesskit(0.0);
    settle(&mut window);
    let volume_mm3 = |window: &Window, n: usize| match &window.state().measurements()[n] {
        bregma_session::Measurement::Volumes(volumes) => volumes.volumes_mm3()[0].1,
        other => panic!("{other:?}"),
    };
    command(&mut window, "Volumes…");
    window.get_by_label("Measure the volume").click();
    wait(&mut window, "the bone", |w| w.measurements().len() == 1);
    window.run_steps(2);
    // The shell without its hole, which is 4 mm long.
    let truth = 4.0 / 3.0 * std::f64::consts::PI * (12.0_f64.powi(3) - 8.0_f64.powi(3)) - std::f64::consts::PI * 4.0 * 4.0;
    assert!((volume_mm3(&window, 0) / truth - 1.0).abs() < 0.01, "{} of {truth}", volume_mm3(&window, 0));
    choose(&mut window, Role::RadioButton, "Cavity");
    assert!(window.get_by_label("Measure the volume").accesskit_node().is_disabled(), "nothing says where");
    command(&mut window, "Axial slice alone");
    command(&mut window, "Landmark");
    settle(&mut window);
    let middle = window.state().slice(bregma_renderer::BodyPlane::Axial).unwrap().1.center();
    click(&mut window, middle);
    window.run_steps(4);
    command(&mut window, "Volumes…");
    window.get_by_label("Measure the volume").click();
    wait_for(&mut window, "Put a lid there");
    assert_eq!(window.state().measurements().len(), 1, "a leak is no volume");
    screenshot(&mut window, "volumes-leak.png");
    window.get_by_label("Put a lid there").click();
    window.run_steps(4);
    window.get_by_label("Radius of lid 1");
    window.get_by_label("Measure the volume").click();
    wait(&mut window, "the cavity", |w| w.measurements().len() == 2);
    window.run_steps(4);
    let truth = 4.0 / 3.0 * std::f64::consts::PI * 8.0_f64.powi(3);
    // The lid lies somewhere within the hole of 50 mm³.
    let mm3 = volume_mm3(&window, 1);
    assert!(mm3 > 0.98 * truth && mm3 < 1.03 * truth, "{mm3} of {truth}");
    screenshot(&mut window, "volumes.png");
    undo(&mut window);
    assert_eq!(window.state().measurements().len(), 1, "a measurement is undone");
}
