//! The window.
/// What to open.
pub enum Start {
    /// The built-in pair.
    Demo,
    /// Scans.
    Files(Vec<crate::input::Source>),
}
/// Opens the window.
pub fn run(_: Start) -> Result<(), eframe::Error> {
    Ok(())
}
