//! What journals ask of figures, as their publishers' own pages say (stored copies, read on 2026-11-28). What a page does not say is not asked.

use super::encoding::Encoding;
use super::form::Form;
use super::sheet::Print;
use bregma_renderer::named;

named! {
    /// Whose figures.
    pub enum Journal {
        /// The journals of PLOS.
        Plos = "plos",
        /// Nature and its sister journals.
        Nature = "nature",
        /// The journals of Elsevier, where their own guide says nothing else.
        Elsevier = "elsevier",
    }
}

/// What is asked of a figure.
#[derive(Clone, Copy, Debug)]
struct Rules {
    /// Narrowest and widest, mm.
    width_mm: Option<[f64; 2]>,
    /// Only these, mm.
    columns_mm: &'static [f64],
    highest_mm: Option<f64>,
    /// Fewest dots an inch without and with marks, and the most.
    dpi: [f64; 2],
    most_dpi: Option<f64>,
    /// Size of type, points.
    type_pt: [f64; 2],
    forms: &'static [Form],
    endings: &'static str,
    /// 8 bits of red, green and blue, without opacity.
    is_plain: bool,
    most_bytes: Option<usize>,
}

/// A length is met to this, mm: half a pixel of 300 dots an inch, by which a sheet of whole pixels is off.
const SAME_MM: f64 = 0.05;

impl Journal {
    fn rules(self) -> Rules {
        match self {
            // journals.plos.org/plosmedicine/s/figures and pace.apexcovantage.com/Home/Guidelines (its checker).
            Self::Plos => Rules {
                width_mm: Some([66.8, 190.5]),
                columns_mm: &[],
                highest_mm: Some(222.3),
                dpi: [300.0; 2],
                most_dpi: Some(600.0),
                type_pt: [8.0, 12.0],
                forms: &[Form::Tiff],
                endings: ".tif",
                is_plain: true,
                most_bytes: Some(10_000_000),
            },
            // research-figure-guide.nature.com, "Building and exporting figure panels" and "Preparing figures - our specifications".
            Self::Nature => Rules {
                width_mm: None,
                columns_mm: &[89.0, 183.0],
                highest_mm: Some(170.0),
                dpi: [300.0; 2],
                most_dpi: None,
                type_pt: [5.0, 7.0],
                forms: &[],
                endings: "",
                is_plain: false,
                most_bytes: None,
            },
            // www.journals.elsevier.com, "Guidelines for accepted papers" (dots and formats); elsevier.com, "Artwork sizing" (type).
            Self::Elsevier => Rules {
                width_mm: None,
                columns_mm: &[],
                highest_mm: None,
                dpi: [300.0, 500.0],
                most_dpi: None,
                type_pt: [7.0, f64::INFINITY],
                forms: &[Form::Tiff, Form::Jpeg, Form::Pdf],
                endings: ".tif, .jpg or .pdf",
                is_plain: false,
                most_bytes: None,
            },
        }
    }

    /// What of a figure is not as it is asked for, each a sentence with what to do; before it is drawn.
    pub fn faults(self, print: &Print, form: Form, encoding: &Encoding, is_clear: bool) -> Vec<String> {
        let rules = self.rules();
        let [width_mm, height_mm] = print.size_mm();
        let mut faults = vec![];
        if let Some([least, most]) = rules.width_mm.filter(|[least, most]| width_mm < least - SAME_MM || width_mm > most + SAME_MM) {
            faults.push(format!("it is {width_mm:.1} mm wide, and {least} to {most} mm are asked for: say --print {most}, or less"));
        }
        if !rules.columns_mm.is_empty() && !rules.columns_mm.iter().any(|mm| (mm - width_mm).abs() <= SAME_MM) {
            let columns = rules.columns_mm.iter().map(f64::to_string).collect::<Vec<_>>().join(" or ");
            faults.push(format!("it is {width_mm:.1} mm wide, and columns are {columns} mm: say --print {}", rules.columns_mm[0]));
        }
        if let Some(most) = rules.highest_mm.filter(|most| height_mm > most + SAME_MM) {
            faults.push(format!("it is {height_mm:.1} mm high, and {most} mm are the most: make it lower by --print"));
        }
        let has_marks =
            print.bar.is_some() || print.letters || print.label.is_some() || print.caption.is_some() || print.legend || print.marks;
        let (dpi, least) = (print.dpi.unwrap_or(0.0), rules.dpi[usize::from(has_marks)]);
        if dpi < least {
            faults.push(format!("it has {dpi} dots an inch, and {least} are the least: say --dpi {least}"));
        }
        if let Some(most) = rules.most_dpi.filter(|most| dpi > *most) {
            faults.push(format!("it has {dpi} dots an inch, and {most} are the most: say --dpi {most}"));
        }
        let [least, most] = rules.type_pt;
        // The figure's letter is half as large again.
        let largest = if print.label.is_some() && most.is_finite() { 1.5 * print.type_pt } else { print.type_pt };
        let has_words = has_marks && (print.type_pt < least || print.type_pt > most);
        if has_words {
            faults.push(format!("its type has {} points, and {}: say --type-size {least}", print.type_pt, asked(least, most)));
        } else if has_marks && largest > most && self == Self::Plos {
            faults.push(format!("its letter has {largest} points, and {most} are the most: say --type-size {least}"));
        }
        if !rules.forms.is_empty() && !rules.forms.contains(&form) {
            faults.push(format!("its form is not taken: end its name in {}", rules.endings));
        }
        if rules.is_plain && (encoding.is_deep || encoding.icc.is_some()) {
            faults.push("it shall be RGB with 8 bits: leave --bits and --icc out".into());
        }
        if rules.is_plain && is_clear {
            faults.push("it shall have no clear ground: say --ground white".into());
        }
        faults
    }

    /// What of a finished file is not as it is asked for.
    pub fn too_large(self, bytes: usize) -> Option<String> {
        let most = self.rules().most_bytes.filter(|most| bytes >= *most)?;
        let mb = |bytes: usize| bytes as f64 / 1e6;
        Some(format!("its file has {:.1} MB, and {:.0} are the most: make it smaller, or give it fewer dots by --dpi", mb(bytes), mb(most)))
    }

    /// What is not as it is asked for, and cannot be helped here.
    pub fn note(self) -> Option<&'static str> {
        match self {
            Self::Nature => {
                Some("nature asks for editable text, and the words in this picture are outlines: set them anew from the SVG's titles")
            }
            Self::Plos => Some("plos asks for captions in the manuscript, and for Arial, Times or Symbol; the letters here are Ubuntu's"),
            Self::Elsevier => None,
        }
    }
}

fn asked(least: f64, most: f64) -> String {
    if most.is_finite() { format!("{least} to {most} are asked for") } else { format!("{least} are the least") }
}
