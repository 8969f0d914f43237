//! Maps of the difference between two scans.

use super::*;
use bregma_field::{Progress, formats};
use bregma_session::{DifferenceBy as By, Source};
use bregma_synthetic::{Which, skull};

#[test]
fn a_map_of_differences_is_measured_painted_and_leads_to_rays() {
    // Fails if the map cannot be cancelled, is not painted on the surface that is asked for, names no place, stays on surfaces that it is not of,
    // or is not kept with what was measured.
    let mut window = open(Start::Demo);
    wait(&mut window, "the demo pair", |w| !w.is_loading());
    settle(&mut window);
    let before = pixels(&window);
    command(&mut window, "Differences");
    window.get_by_label("Measure the difference").click();
    window.run_steps(2);
    window.get_by_label("Cancel").click();
    window.run_steps(2);
    assert!(window.state().differences().is_none(), "a cancelled measurement leaves nothing");
    window.get_by_label("Measure the difference").click();
    wait(&mut window, "the map", |w| w.differences().is_some());
    settle(&mut window);
    let painted = pixels(&window);
    assert!(changed(&before, &painted) > 20_000);
    let ids = &window.state().picture().unwrap().volume_id;
    assert!(ids.contains(&1) && !ids.contains(&2), "the map is on skull A alone");
    window.get_by_label("Legend of the difference");
    window.get_by_label_contains("stands out over");
    screenshot(&mut window, "differences.png");
    let target = on_bone(&window);
    window.event(Event::PointerMoved(target));
    window.run_steps(4);
    assert!(window.state().under().contains("difference "), "{}", window.state().under());
    // The other surface wears the same map.
    choose(&mut window, Role::RadioButton, "on skull B");
    assert!(window.state().picture().unwrap().volume_id.contains(&2));
    choose(&mut window, Role::RadioButton, "on skull A");
    choose(&mut window, Role::CheckBox, "Lines");
    assert!(changed(&painted, &pixels(&window)) > 200);
    choose(&mut window, Role::CheckBox, "Show on the surface");
    assert_eq!(changed(&before, &pixels(&window)), 0);
    // One scan against itself mirrored, and back: the pair is there again.
    choose(&mut window, Role::RadioButton, "Asymmetry");
    window.get_by_label("First scan");
    assert!(window.query_by_label("Second scan").is_none());
    choose(&mut window, Role::RadioButton, "Partners");
    window.get_by_label("Second scan");
    assert!(!window.get_by_label("Measure the difference").accesskit_node().is_disabled());
    // A difference leads to its ray.
    let rays = |window: &Window| window.state().difference_ray().is_some();
    assert!(!rays(&window));
    let link = window.get_all_by_role(Role::Link).next().expect("the largest differences are named");
    link.scroll_to_me();
    window.run_steps(4);
    window.get_all_by_role(Role::Link).next().unwrap().click();
    window.run_steps(4);
    assert!(rays(&window));
    undo(&mut window);
    window.get_by_role_and_label(Role::Slider, "Isovalue of skull A").set_value_accesskit(400.0);
    settle(&mut window);
    window.get_by_label_contains("measure again");
    let measured = window.state().differences().unwrap();
    assert_eq!((measured.order.by, measured.halves.len()), (By::Partner, 2));
}

/// The demo pair of few samples, as files.
pub fn small_pair(name: &str, size: usize) -> Vec<Source> {
    [Which::A, Which::B]
        .map(|which| {
            let file = std::env::temp_dir().join(format!("bregma-window-{}-{name}-{which:?}.nrrd", std::process::id()));
            formats::write(&file, &skull(which, size, &Progress::default()).unwrap(), &Progress::default()).unwrap();
            Source { file, ..Source::default() }
        })
        .to_vec()
}

#[test]
fn a_map_leads_from_a_ray_to_its_partner_its_legend_is_drawn_by_hand_and_slices_wear_it() {
    // Fails if what belongs to a place cannot be reached from it, a hand on the legend does nothing, or slices stay as they were.
    let mut window = open(Start::Files(small_pair("worn", 64)));
    wait(&mut window, "the pair", |w| !w.is_loading());
    settle(&mut window);
    command(&mut window, "Differences");
    window.get_by_label("Measure the difference").click();
    wait(&mut window, "the map", |w| w.differences().is_some());
    settle(&mut window);
    let target = on_bone(&window);
    click(&mut window, target);
    settle(&mut window);
    command(&mut window, "Differences");
    window.get_by_label_contains("At the selected ray: ");
    let first = window.state().difference_ray().cloned();
    assert!(first.is_some());
    let partner = window.get_by_label_contains("partner at ");
    partner.scroll_to_me();
    window.run_steps(4);
    window.get_by_label_contains("partner at ").click();
    window.run_steps(4);
    assert!(window.state().difference_ray().cloned() != first, "the ray through both is another one");
    undo(&mut window);
    let legend = rect_of(&window, "Legend of the difference");
    let range = |window: &Window| window.get_by_label("End of the colours").value().unwrap();
    assert!(window.query_by_label("End of the colours").is_none());
    drag(&mut window, legend.center() + egui::vec2(40.0, 0.0), legend.center() + egui::vec2(80.0, 0.0));
    let wide = range(&window);
    drag(&mut window, legend.center() + egui::vec2(-40.0, 0.0), legend.center() + egui::vec2(0.0, 0.0));
    assert_ne!(range(&window), wide);
    command(&mut window, "Axial slice alone");
    settle(&mut window);
    let slice = |window: &Window| window.state().slice(bregma_renderer::BodyPlane::Axial).unwrap().0.rgba.clone();
    let worn = slice(&window);
    screenshot(&mut window, "differences-slice.png");
    choose(&mut window, Role::CheckBox, "Show on the surface");
    settle(&mut window);
    assert!(changed(&worn, &slice(&window)) > 200);
}
