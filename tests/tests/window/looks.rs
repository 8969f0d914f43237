//! Looks that are kept by name.

use super::*;

fn named(window: &mut Window, field: &str, name: &str, button: &str) {
    type_into(window, field, name);
    window.get_by_label(button).click();
    window.run_steps(3);
}

fn type_into(window: &mut Window, field: &str, text: &str) {
    let field = window.get_by_label(field);
    field.focus();
    field.type_text(text);
    window.run_steps(3);
}

#[test]
fn looks_are_saved_taken_renamed_and_deleted() {
    // Fails if a look that was saved does not come back, moves an isovalue, or cannot be renamed and thrown away. It writes files: only where their
    // folder is a test's own.
    if std::env::var_os("BREGMA_OWN_LOOKS").is_none() {
        println!("skipped: looks are written to a person's settings, and BREGMA_OWN_LOOKS says of no other folder; tests/run does");
        return;
    }
    let mut window = open(Start::Demo);
    wait(&mut window, "the demo pair", |w| !w.is_loading());
    settle(&mut window);
    choose(&mut window, Role::RadioButton, "Transparent");
    settle(&mut window);
    command(&mut window, "Looks…");
    named(&mut window, "Name of the look", "clear", "Save this look");
    choose(&mut window, Role::RadioButton, "Isosurface");
    settle(&mut window);
    let isovalue = window.state().scene().layers[0].iso;
    window.get_by_label("clear").click();
    settle(&mut window);
    assert_eq!((window.state().scene().mode, window.state().scene().layers[0].iso), (Mode::Transparent, isovalue));
    window.get_all_by_label("Rename…").next().unwrap().click();
    window.run_steps(3);
    type_into(&mut window, "New name of clear", " glass");
    window.get_by_label("Rename").click();
    window.run_steps(3);
    assert!(window.query_by_label("clear glass").is_some() && window.query_by_label("clear").is_none());
    window.get_by_label("Delete…").click();
    window.run_steps(3);
    window.get_by_label("Delete").click();
    window.run_steps(3);
    assert!(window.query_by_label("clear glass").is_none());

    named(&mut window, "Name of the transfer function", "mine", "Save this one");
    assert!(window.query_by_label("mine").is_some());
    screenshot(&mut window, "looks.png");
    window.get_by_label("mine").click();
    settle(&mut window);
    assert_eq!(window.state().scene().layers[0].transfer.as_ref().map(|t| t.name.as_str()), Some("mine"));
}
