//! A line to type a path into, completed from what lies there: where the system shows no file dialog.

use super::ask::{Ask, Kind};
use egui::{Button, Context, Event, Key, Modifiers, RichText, ScrollArea, TextEdit, Ui, Window};
use std::path::{Path, PathBuf};

/// The line, and what is asked for.
pub struct PathPrompt {
    ask: Ask,
    typed: String,
    /// The file is there already, and the person was told.
    overwrites: bool,
    problem: Option<String>,
    /// The line is to have the keyboard: at first, and whenever something else has answered for it.
    takes_keyboard: bool,
}

/// More than these help nobody to choose.
const MOST: usize = 200;

impl PathPrompt {
    /// Begins in the folder that the program was started in, or in the person's own.
    pub fn new(ask: Ask) -> Self {
        let here = std::env::current_dir().ok().or_else(|| std::env::var_os("HOME").map(PathBuf::from)).unwrap_or_default();
        let typed = here.join(ask.name).to_string_lossy().into_owned();
        Self { ask, typed, overwrites: false, problem: None, takes_keyboard: true }
    }

    /// Shows it. Gives what was chosen, nothing when it was cancelled, once it is.
    pub fn show(&mut self, ctx: &Context) -> Option<Vec<PathBuf>> {
        let mut answer = None;
        let window = Window::new(self.ask.title).collapsible(false).resizable(false).pivot(egui::Align2::CENTER_CENTER);
        window.default_pos(ctx.content_rect().center()).show(ctx, |ui| answer = self.contents(ui));
        if answer.is_some() {
            // Keys of a slow frame, in which the path was typed and taken, are the path's: no command, and no turn of the view.
            ctx.input_mut(|i| i.events.retain(|event| !matches!(event, Event::Key { .. } | Event::Text(_))));
        }
        answer
    }

    fn contents(&mut self, ui: &mut Ui) -> Option<Vec<PathBuf>> {
        ui.set_width(460.0);
        ui.weak("This desktop shows no file dialog; Tab completes a name.");
        let completes = ui.input_mut(|i| i.consume_key(Modifiers::NONE, Key::Tab));
        let edit = TextEdit::singleline(&mut self.typed).desired_width(460.0).lock_focus(true);
        let edit = ui.add(edit).accessible_name("Path");
        if edit.changed() {
            (self.overwrites, self.problem) = (false, None);
        }
        let found = completions(&self.typed, self.ask.kind == Kind::Folders);
        if completes {
            self.typed = completed(&self.typed, &found);
        }
        if std::mem::take(&mut self.takes_keyboard) || completes {
            edit.request_focus();
        }
        ScrollArea::vertical().max_height(180.0).min_scrolled_height(180.0).auto_shrink([false, false]).show(ui, |ui| {
            for path in found.iter().take(MOST) {
                if ui.add(Button::selectable(false, last_name(path)).truncate()).clicked() {
                    self.typed.clone_from(path);
                    (self.overwrites, self.problem) = (false, None);
                    self.takes_keyboard = true;
                }
            }
        });
        if let Some(problem) = &self.problem {
            ui.label(RichText::new(problem).color(ui.visuals().warn_fg_color));
        }
        let enter = edit.lost_focus() && ui.input(|i| i.key_pressed(Key::Enter));
        let deed = if self.ask.kind == Kind::Save { "Save" } else { "Open" };
        ui.horizontal(|ui| {
            if ui.button(deed).clicked() || enter {
                return self.chosen();
            }
            let escape = ui.input_mut(|i| i.consume_key(Modifiers::NONE, Key::Escape));
            (ui.button("Cancel").clicked() || escape).then(Vec::new)
        })
        .inner
    }

    /// What is typed, where it can be what is asked for.
    fn chosen(&mut self) -> Option<Vec<PathBuf>> {
        let path = expanded(&self.typed);
        let is_there = path.exists();
        self.problem = match self.ask.kind {
            Kind::Files | Kind::Folders if !is_there => Some(format!("{}: there is no such file or folder", path.display())),
            Kind::Save if path.is_dir() => Some(format!("{}: is a folder; add a name", path.display())),
            Kind::Save if is_there && !self.overwrites => {
                self.overwrites = true;
                Some("There is such a file. Save again to replace it.".into())
            }
            _ => return Some(vec![path]),
        };
        self.takes_keyboard = true;
        None
    }
}

/// A path with the person's folder for its `~`.
fn expanded(typed: &str) -> PathBuf {
    match (typed.strip_prefix("~/"), std::env::var_os("HOME")) {
        (Some(rest), Some(home)) => Path::new(&home).join(rest),
        _ => PathBuf::from(typed),
    }
}

/// What begins as `typed` does, in order; folders end in a slash.
fn completions(typed: &str, only_folders: bool) -> Vec<String> {
    let (folder, begun) = typed.rsplit_once('/').map_or(("", typed), |(folder, begun)| (folder, begun));
    let listed = if typed.contains('/') { expanded(&format!("{folder}/")) } else { PathBuf::from(".") };
    let entries = std::fs::read_dir(listed).into_iter().flatten().flatten();
    let path = |entry: std::fs::DirEntry| {
        let name = entry.file_name().to_string_lossy().into_owned();
        // Hidden files are not what is looked for unless their dot is typed.
        let fits = name.to_lowercase().starts_with(&begun.to_lowercase()) && (begun.starts_with('.') || !name.starts_with('.'));
        let is_folder = entry.path().is_dir();
        let before = if typed.contains('/') { format!("{folder}/") } else { String::new() };
        (fits && (is_folder || !only_folders)).then(|| format!("{before}{name}{}", if is_folder { "/" } else { "" }))
    };
    let mut found: Vec<String> = entries.filter_map(path).collect();
    found.sort();
    found
}

/// What all completions have in common, or what is typed where that is no more.
fn completed(typed: &str, found: &[String]) -> String {
    let Some(first) = found.first() else { return typed.to_owned() };
    let common = found.iter().fold(first.as_str(), |common, path| {
        let same = common.char_indices().zip(path.chars()).take_while(|((_, a), b)| a == b);
        &common[..same.last().map_or(0, |((at, c), _)| at + c.len_utf8())]
    });
    if common.len() > typed.len() { common.to_owned() } else { typed.to_owned() }
}

/// The last part of a path, with the slash of a folder.
fn last_name(path: &str) -> &str {
    let end = path.strip_suffix('/').unwrap_or(path);
    &path[end.rfind('/').map_or(0, |at| at + 1)..]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_completed_as_far_as_they_agree() {
        // Fails if completing leaves the folder, offers what begins otherwise, or cuts a letter of several bytes.
        let folder = std::env::temp_dir().join(format!("bregma-prompt-{}", std::process::id()));
        std::fs::create_dir_all(folder.join("Schädel")).unwrap();
        for name in ["skull A.nrrd", "skull B.nrrd", ".hidden"] {
            std::fs::write(folder.join(name), "").unwrap();
        }
        let typed = |end: &str| format!("{}/{end}", folder.display());
        let found = completions(&typed("SK"), false);
        assert_eq!(found, [typed("skull A.nrrd"), typed("skull B.nrrd")]);
        assert_eq!(completed(&typed("sk"), &found), typed("skull "));
        assert_eq!(completions(&typed(""), true), [typed("Schädel/")]);
        assert_eq!(completions(&typed("."), false), [typed(".hidden")]);
        assert_eq!((last_name("/a/b/"), last_name("/a/b.c"), last_name("b")), ("b/", "b.c", "b"));
        assert_eq!(completed("x", &[]), "x");
        std::fs::remove_dir_all(folder).unwrap();
    }

    #[test]
    fn it_is_typed_into_at_once() {
        // Fails if the line waits for a click: what is typed would be taken for the keys of commands.
        let ctx = Context::default();
        let folder = std::env::temp_dir().to_string_lossy().into_owned();
        let mut prompt = PathPrompt::new(Ask::open("Open", Kind::Folders));
        let mut answer = None;
        let mut frame = |events| {
            let input = egui::RawInput { events, ..Default::default() };
            let _ = ctx.run_pass(input, |ctx| answer = answer.take().or(prompt.show(ctx)));
        };
        let press = |key, modifiers| Event::Key { key, physical_key: None, pressed: true, repeat: false, modifiers };
        (0..3).for_each(|_| frame(vec![]));
        for wrong in ["/no/such", &folder] {
            frame(vec![press(Key::A, Modifiers::COMMAND), Event::Text(wrong.to_owned())]);
            frame(vec![press(Key::Enter, Modifiers::NONE)]);
            frame(vec![]);
        }
        assert_eq!(answer, Some(vec![folder.into()]));
    }

    #[test]
    fn keys_of_the_frame_that_takes_the_path_are_nothing_elses() {
        // Fails if a slow frame, in which a path is typed and taken, is also one of commands: S would show slices.
        let ctx = Context::default();
        let mut prompt = PathPrompt::new(Ask::open("Open", Kind::Folders));
        prompt.typed = std::env::temp_dir().to_string_lossy().into_owned();
        let press = |key| Event::Key { key, physical_key: None, pressed: true, repeat: false, modifiers: Modifiers::NONE };
        let (mut answer, mut left) = (None, 0);
        for events in [vec![], vec![], vec![press(Key::Slash), Event::Text("/".into()), press(Key::Enter)]] {
            let input = egui::RawInput { events, ..Default::default() };
            let _ = ctx.run_pass(input, |ctx| {
                answer = answer.take().or(prompt.show(ctx));
                left = ctx.input(|i| i.events.len());
            });
        }
        assert!(answer.is_some() && left == 0, "{answer:?}, {left} keys left");
    }

    #[test]
    fn a_file_is_replaced_only_when_that_was_said() {
        // Fails if a save by the line overwrites at once, or a folder is taken for a file.
        let file = std::env::temp_dir().join(format!("bregma-there-{}.csv", std::process::id()));
        std::fs::write(&file, "").unwrap();
        let mut prompt = PathPrompt::new(Ask { kind: Kind::Save, name: "a.csv", ..Ask::open("Save", Kind::Save) });
        prompt.typed = file.to_string_lossy().into_owned();
        assert!(prompt.chosen().is_none() && prompt.problem.is_some());
        assert_eq!(prompt.chosen(), Some(vec![file.clone()]));
        prompt.typed = std::env::temp_dir().to_string_lossy().into_owned();
        assert!(prompt.chosen().is_none());
        std::fs::remove_file(file).unwrap();
    }
}
