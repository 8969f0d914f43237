//! The one table of what each mode is: its name, how a picture is gathered along the rays, and which settings of a scene count in it.
//!
//! A new mode is a row here, what gathers it (`cpu/`, `shaders/`), and a test.

use crate::named;

named! {
    /// How a picture is made of several volumes.
    #[derive(Default)]
    pub enum Mode {
        /// The nearest surface.
        #[default]
        Iso = "iso",
        /// Every crossing along the ray: surfaces let those behind show through by their opacity, until 0.95 is reached.
        Transparent = "transparent",
        /// The nearest first hit transparent, the next volume's first hit opaque behind it; a lone hit is opaque. Where the two agree they are one.
        Overlay = "overlay",
        /// The nearest first hit, in a colour for how far behind it the next volume's first hit lies; alone, in its own.
        Depths = "depths",
        /// Direct volume rendering by a transfer function: light that the whole volume sends and keeps (Max 1995).
        Dvr = "dvr",
        /// The largest value along the ray.
        Max = "max",
        /// The smallest value along the ray.
        Min = "min",
        /// The mean of the values along the ray.
        Mean = "mean",
        /// The integral of the values along the ray, drawn by Beer's law.
        Xray = "xray",
        /// The values on the plane through the camera's target, with the contours of the surfaces.
        Slice = "slice",
    }
}

/// What of each ray makes a picture.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Gather {
    /// The nearest first hit of all volumes.
    Nearest,
    /// The first hit of each volume, the nearest of them transparent.
    FirstOfEach,
    /// Every crossing of surfaces, of all volumes in the order of depth.
    Crossings,
    /// The density, of all volumes in the order of depth.
    Density,
    /// One number for each volume, coloured when all are known.
    Number(RayValue),
    /// What lies on the plane through the camera's target, across its view.
    Plane,
}

/// The number that a ray makes of a volume.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum RayValue {
    /// The largest value.
    Max,
    /// The smallest value.
    Min,
    /// The mean of the values.
    Mean,
    /// Their integral over the length, mm.
    Integral,
}

impl RayValue {
    /// What values are multiplied with so that the one that is sought is the largest; none where it is a sum of them all.
    pub(crate) fn extreme(self) -> Option<f32> {
        match self {
            Self::Max => Some(1.0),
            Self::Min => Some(-1.0),
            Self::Mean | Self::Integral => None,
        }
    }

    /// Of a sum, or an extreme, and the depth that it is of: the mean where that is sought; NaN of no depth.
    pub(crate) fn shown(self, [value, depth]: [f32; 2]) -> f32 {
        match self {
            Self::Mean if depth > 0.0 => value / depth,
            Self::Mean => f32::NAN,
            Self::Max | Self::Min | Self::Integral => value,
        }
    }
}

/// A setting of a scene that counts in some modes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Setting {
    /// How roots are found, and the spline between samples.
    Solver,
    /// Shadows, and the opacity of surfaces.
    Surfaces,
    /// Further isosurfaces, and colours of surfaces seen from within.
    Shells,
    /// The transfer function, and how it is integrated.
    Transfer,
    /// Which gradient shades, the depth cue, and the faces of cuts.
    Shading,
    /// The gradient's magnitude instead of the value, and the window of grey values.
    Numbers,
    /// How near to each other two surfaces count as one.
    Agreement,
    /// Within what depths between two surfaces are told apart.
    Depths,
    /// The plane's thickness, colours and contours, and the window of grey values.
    Slice,
}

/// A row of the table.
#[derive(Debug)]
pub struct Facts {
    /// As people read it.
    pub title: &'static str,
    /// What it is good for, for people.
    pub shows: &'static str,
    /// How it is gathered.
    pub gather: Gather,
    /// What counts.
    pub settings: &'static [Setting],
}

impl Mode {
    /// Its row.
    pub fn facts(self) -> Facts {
        use Setting::{Agreement, Depths, Numbers, Shading, Shells, Slice, Solver, Surfaces, Transfer};
        let row = |title, shows, gather, settings| Facts { title, shows, gather, settings };
        match self {
            Self::Iso => row("Isosurface", "The nearest surface", Gather::Nearest, &[Solver, Surfaces, Shading]),
            Self::Transparent => row(
                "Transparent",
                "Surfaces let those behind them show through; each volume may have several",
                Gather::Crossings,
                &[Surfaces, Shells, Shading],
            ),
            Self::Overlay => row(
                "Overlay",
                "Where two surfaces agree they are one, in bone's colour; elsewhere the nearer volume is transparent, the other one opaque behind it",
                Gather::FirstOfEach,
                &[Solver, Surfaces, Shading, Agreement],
            ),
            Self::Depths => row(
                "Depths",
                "How far the other scan's surface lies behind the nearest one, along the line of sight: red where the second scan stands out, blue where \
                 the first one does, bone where they are as near",
                Gather::FirstOfEach,
                &[Solver, Surfaces, Shading, Depths],
            ),
            Self::Dvr => row(
                "Volume",
                "Looks through the density: every value has a colour and an opacity (direct volume rendering)",
                Gather::Density,
                &[Transfer, Shading],
            ),
            Self::Max => row(
                "Maximum",
                "The largest value along each line of sight: metal and enamel stand out, sutures are dark lines",
                Gather::Number(RayValue::Max),
                &[Numbers],
            ),
            Self::Min => row(
                "Minimum",
                "The smallest value along each line of sight: air and canals stand out",
                Gather::Number(RayValue::Min),
                &[Numbers],
            ),
            Self::Mean => row("Mean", "The mean of the values along each line of sight", Gather::Number(RayValue::Mean), &[Numbers]),
            Self::Xray => row(
                "X-ray",
                "The values along each line of sight added up, as on a radiograph",
                Gather::Number(RayValue::Integral),
                &[Numbers],
            ),
            Self::Slice => row(
                "Slice",
                "The values on the plane through what is looked at, with the contours of the surfaces",
                Gather::Plane,
                &[Slice],
            ),
        }
    }

    /// How it is gathered.
    pub fn gather(self) -> Gather {
        self.facts().gather
    }

    /// Whether a setting changes what is drawn.
    pub fn uses(self, setting: Setting) -> bool {
        self.facts().settings.contains(&setting)
    }
}
