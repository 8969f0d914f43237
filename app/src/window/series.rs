//! Which of the series in a folder or zip is meant.

use bregma_field::Progress;
use bregma_field::formats::{self, Series};
use bregma_session::Source;
use egui::{ScrollArea, Ui};
use std::path::PathBuf;

/// Series to choose from, the largest first, which is chosen unless the person says otherwise.
#[derive(Debug)]
pub struct Choice {
    list: Vec<Series>,
    chosen: usize,
}

impl Choice {
    /// The first source that holds several series, and what they are. What cannot be read is told when its turn comes.
    pub fn among(sources: &[Source], progress: &Progress) -> Option<(usize, Self)> {
        sources.iter().enumerate().find_map(|(of, source)| {
            let list = formats::series(&source.file, progress).ok().filter(|list| list.len() > 1)?;
            Some((of, Self { list, chosen: 0 }))
        })
    }

    /// A line for each series.
    pub fn ui(&mut self, ui: &mut Ui) {
        // Ten lines, also where the room on the empty window is less.
        ScrollArea::vertical().min_scrolled_height(240.0).max_height(240.0).show(ui, |ui| {
            for (n, series) in self.list.iter().enumerate() {
                let what = series.description.as_deref().unwrap_or("Without description");
                let slices = if series.images == 1 { "slice" } else { "slices" };
                let text = format!("{what}  ·  series {}  ·  {} {slices}", series.key, series.images);
                ui.radio_value(&mut self.chosen, n, text);
            }
        });
    }

    /// Names the chosen series.
    pub fn apply(&self, source: &mut Source) {
        // Without a slash at its end, so that the number belongs to the folder's name.
        let mut named = source.file.components().collect::<PathBuf>().into_os_string();
        named.push(format!("#{}", self.list[self.chosen].key));
        source.file = named.into();
    }
}
