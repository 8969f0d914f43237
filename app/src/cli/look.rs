//! What options say of how a scene looks, for `render` and `bench` alike.

use super::error::CommandError;
use super::parsers::{color, length, number, numbers, one_of, positive, range, share};
use bregma_renderer::{
    Clip, Color, CutFace, GradientPoint, Integrator, Layer, Mode, Normals, OVERALL, PER_VOXEL, Reconstruction, Scene, Setting, Shape,
    Shell, Slab, TransferFunction, WIDEST_CONTOUR_PX, Window,
};
use bregma_session::presets::{self, Preset};
use bregma_session::{Opened, looks};
use clap::Args;
use glam::DVec3;

/// How the scene looks.
#[derive(Debug, Args)]
pub struct LookArgs {
    /// A look that was saved in the window, or its file: mode, light, colours and transfer functions; other options go before it
    #[arg(long, value_name = "NAME|FILE")]
    pub look: Option<String>,
    /// Surfaces keep the light from each other
    #[arg(long)]
    pub shadows: bool,
    /// Toward the light, in the picture's right, up and toward the viewer [default: -0.4,0.5,1]
    #[arg(long, value_name = "X,Y,Z", value_parser = direction, allow_hyphen_values = true)]
    pub light: Option<DVec3>,
    /// Phong's model: the ambient, the diffuse and the specular part (0 to 1) and the exponent [default: 0.08,0.85,0.12,24]
    #[arg(long, value_name = "A,D,S,N", value_parser = phong)]
    pub phong: Option<[f64; 4]>,
    /// How much of the diffuse part what lies in shadow loses, 0 to 1 [default: 0.7]
    #[arg(long, value_name = "V", value_parser = share)]
    pub shadow: Option<f64>,
    /// Opacity of surfaces that are drawn transparent, by overlay, or by iso, which draws all crossings then: once for all, or once for each
    /// volume
    #[arg(long, value_name = "V", value_parser = share, value_delimiter = ',')]
    pub opacity: Vec<f64>,
    /// Surface colour RRGGBB: once for all, or once for each volume
    #[arg(long, value_name = "HEX", value_parser = color, value_delimiter = ',')]
    pub color: Vec<Color>,
    /// Colour of surfaces seen from within the bone, where they are transparent: once for all, or once for each volume
    #[arg(long, value_name = "HEX", value_parser = color, value_delimiter = ',')]
    pub inner_color: Vec<Color>,
    /// A further isosurface of volume N (from 1), where surfaces are transparent; may be given again
    #[arg(long, value_name = "N:ISO,HEX,OPACITY", value_parser = shell, allow_hyphen_values = true)]
    pub shell: Vec<(usize, Shell)>,
    /// How dvr colours values: bone, skin-and-bone, dry-skull, mummy, µct, one of your own, or a file: once for all, or once for each volume
    #[arg(long, value_name = "NAME|FILE", value_delimiter = ',')]
    pub transfer: Vec<String>,
    /// A transfer function with its further isosurfaces, by the same names: once for all, or once for each volume. It moves no isovalue
    #[arg(long, value_name = "NAME|FILE", value_delimiter = ',', conflicts_with = "transfer")]
    pub preset: Vec<String>,
    /// What the opacities of dvr are multiplied with along each mm, 0.001 to 1000: once for all, or once for each volume
    #[arg(long, value_name = "V", value_parser = overall, value_delimiter = ',')]
    pub overall_opacity: Vec<f64>,
    /// Factors of the opacity of dvr by how fast values change, per mm, ascending; given again, of the next volume
    #[arg(long, value_name = "PER_MM:FACTOR,...", value_parser = by_gradient)]
    pub gradient_opacity: Vec<ByGradient>,
    /// How dvr integrates: exact, or steps:N with N points in a voxel's length [default: steps:2]
    #[arg(long, value_name = "exact|steps:N", value_parser = integrator)]
    pub integrator: Option<Integrator>,
    /// Every pixel's first step of dvr is whole: rings instead of noise
    #[arg(long)]
    pub no_jitter: bool,
    /// What lies between the samples, of opaque surfaces
    #[arg(long, value_parser = one_of::<Reconstruction>())]
    pub reconstruction: Option<Reconstruction>,
    /// Which gradient shades
    #[arg(long, value_parser = one_of::<Normals>())]
    pub normals: Option<Normals>,
    /// max, mean and xray of the gradient's magnitude, per mm
    #[arg(long)]
    pub gradient: bool,
    /// max, min, mean and xray of only what has values between two: bone without the air around it, or air without the bone
    #[arg(long, value_name = "LOW,HIGH", value_parser = range, allow_hyphen_values = true)]
    pub value_range: Option<[f64; 2]>,
    /// From black to white, in values (xray: what --values would be without air); when absent what the picture holds, or on faces of cuts
    /// 1000 about 400 HU, or the scan's range
    #[arg(long, value_name = "W", value_parser = positive, requires = "level")]
    pub window: Option<f64>,
    /// The middle of the window
    #[arg(long, value_name = "L", value_parser = number, allow_hyphen_values = true, requires = "window")]
    pub level: Option<f64>,
    /// Keeps n·x ≤ D, mm, of all volumes, or of volume N (from 1) alone; may be given again
    #[arg(long, value_name = "NX,NY,NZ,D[@N]", value_parser = plane, allow_hyphen_values = true)]
    pub clip: Vec<Clip>,
    /// Keeps a box along the world's axes, mm; may be given again
    #[arg(long, value_name = "X0,Y0,Z0,X1,Y1,Z1[@N]", value_parser = cuboid, allow_hyphen_values = true)]
    pub crop: Vec<Clip>,
    /// Keeps a cylinder along a direction, mm: a point of its axis, the direction, the radius; may be given again
    #[arg(long, value_name = "X,Y,Z,DX,DY,DZ,R[@N]", value_parser = cylinder, allow_hyphen_values = true)]
    pub cylinder: Vec<Clip>,
    /// Keeps a sphere, mm: its middle and its radius; may be given again
    #[arg(long, value_name = "X,Y,Z,R[@N]", value_parser = sphere, allow_hyphen_values = true)]
    pub sphere: Vec<Clip>,
    /// What cuts show of a volume, or slices
    #[arg(long, value_parser = one_of::<CutFace>())]
    pub cut_face: Option<CutFace>,
    /// Within what the surfaces of an overlay agree and are drawn as one, mm; 0 for never [default: half a voxel of the coarser scan, or how sure
    /// the registration is]
    #[arg(long, value_name = "MM", value_parser = length)]
    pub agree: Option<f64>,
    /// How far apart along the ray surfaces lie at the ends of the colours of --mode depths, mm [default: about a fortieth of the scans' size]
    #[arg(long, value_name = "MM", value_parser = positive)]
    pub depth_range: Option<f64>,
    /// How thick a slice is, half of it on either side of its plane, mm
    #[arg(long, value_name = "MM", value_parser = positive)]
    pub thickness: Option<f64>,
    /// What a thick slice shows of its thickness
    #[arg(long, value_parser = one_of::<Slab>(), requires = "thickness")]
    pub slab: Option<Slab>,
    /// How wide the contours of the surfaces are drawn on a slice, pixels; 0 for none [default: 1.5]
    #[arg(long, value_name = "PX", value_parser = contour)]
    pub contour: Option<f32>,
    /// How much of the background's colour the farthest takes on, 0 to 1
    #[arg(long, value_name = "V", value_parser = share)]
    pub depth_cue: Option<f64>,
}

pub fn no_volume(n: usize, count: usize) -> CommandError {
    CommandError::Usage(format!("there is no volume {n}; there are {count}, counted from 1"))
}

/// Applies values that are given once for all, or once for each.
pub fn set_each<L, V>(layers: &mut [L], values: &[V], option: &str, set: impl Fn(&mut L, &V)) -> Result<(), CommandError> {
    let count = layers.len();
    match values {
        [] => {}
        [one] => layers.iter_mut().for_each(|layer| set(layer, one)),
        many if many.len() == count => layers.iter_mut().zip(many).for_each(|(layer, value)| set(layer, value)),
        many => {
            let text = format!("{option} is given {} times for {count} volumes; give it once for all, or once for each", many.len());
            return Err(CommandError::Usage(text));
        }
    }
    Ok(())
}

impl LookArgs {
    /// Gives the scene this look, in `mode` where that is asked for.
    pub fn apply(&self, opened: &mut Opened, mode: Option<Mode>) -> Result<(), CommandError> {
        if let Some(name) = &self.look {
            looks::find(name)?.apply(&mut opened.scene);
        }
        opened.scene.mode = mode.unwrap_or(opened.scene.mode);
        self.apply_ready_made(opened)?;
        self.apply_to_layers(&mut opened.scene)?;
        self.apply_to_scene(&mut opened.scene)?;
        self.apply_cuts(&mut opened.scene)
    }

    /// Presets and transfer functions.
    fn apply_ready_made(&self, opened: &mut Opened) -> Result<(), CommandError> {
        let scene = &mut opened.scene;
        let find = |names: &[String]| names.iter().map(|name| presets::find(name)).collect::<Result<Vec<_>, _>>();
        if !self.preset.is_empty() {
            let mut layers: Vec<_> = scene.layers.iter_mut().zip(&opened.volumes).collect();
            set_each(&mut layers, &find(&self.preset)?, "--preset", |(layer, volume), look| look.apply(layer, volume))?;
            if scene.layers.iter().any(|l| !l.shells.is_empty()) {
                show_through(scene);
            }
        }
        let set = |layer: &mut Layer, look: &Preset| layer.transfer = Some(look.transfer.clone());
        set_each(&mut scene.layers, &find(&self.transfer)?, "--transfer", set)?;
        let denser =
            |layer: &mut Layer, overall: &f64| layer.transfer = Some(TransferFunction { overall: *overall, ..layer.transfer_function() });
        set_each(&mut scene.layers, &self.overall_opacity, "--overall-opacity", denser)?;
        let edges = |layer: &mut Layer, by: &ByGradient| {
            layer.transfer = Some(TransferFunction { gradient: by.0.clone(), ..layer.transfer_function() });
        };
        set_each(&mut scene.layers, &self.gradient_opacity, "--gradient-opacity", edges)
    }

    /// Colours, opacities and further isosurfaces.
    fn apply_to_layers(&self, scene: &mut Scene) -> Result<(), CommandError> {
        set_each(&mut scene.layers, &self.opacity, "--opacity", |layer, v| layer.opacity = *v as f32)?;
        set_each(&mut scene.layers, &self.color, "--color", |layer, c| layer.color = *c)?;
        set_each(&mut scene.layers, &self.inner_color, "--inner-color", |layer, c| layer.inner_color = Some(*c))?;
        let count = scene.layers.len();
        for (n, shell) in &self.shell {
            scene.layers.get_mut(n - 1).ok_or_else(|| no_volume(*n, count))?.shells.push(*shell);
        }
        if !(self.opacity.is_empty() && self.shell.is_empty()) {
            show_through(scene);
        }
        Ok(())
    }

    fn apply_to_scene(&self, scene: &mut Scene) -> Result<(), CommandError> {
        scene.shadows |= self.shadows;
        let light = &mut scene.light;
        light.toward = self.light.map_or(light.toward, |toward| toward.as_vec3());
        light.shadow = self.shadow.map_or(light.shadow, |v| v as f32);
        if let Some(phong) = self.phong {
            [light.ambient, light.diffuse, light.specular, light.shininess] = phong.map(|v| v as f32);
        }
        scene.of_gradient |= self.gradient;
        scene.value_range = self.value_range.or(scene.value_range);
        scene.integrator = self.integrator.unwrap_or(scene.integrator);
        if let (true, Integrator::Steps { jitter, .. }) = (self.no_jitter, &mut scene.integrator) {
            *jitter = false;
        }
        scene.normals = self.normals.unwrap_or(scene.normals);
        scene.reconstruction = self.reconstruction.unwrap_or(scene.reconstruction);
        if self.reconstruction.is_some_and(|r| r != Reconstruction::Trilinear) && !scene.mode.uses(Setting::Solver) {
            let text = "--reconstruction spline and nearest are of opaque surfaces: use --mode overlay, or --mode iso without --opacity and --shell";
            return Err(CommandError::Usage(text.into()));
        }
        if scene.is_slice() {
            scene.slice.face = self.cut_face.unwrap_or(scene.slice.face);
        } else {
            scene.cut_face = self.cut_face.unwrap_or(scene.cut_face);
        }
        scene.agree_within_mm = self.agree.or(scene.agree_within_mm);
        scene.depths_within_mm = self.depth_range.or(scene.depths_within_mm);
        scene.slice.thickness_mm = self.thickness.unwrap_or(scene.slice.thickness_mm);
        scene.slice.slab = self.slab.unwrap_or(scene.slice.slab);
        scene.slice.contour_px = self.contour.unwrap_or(scene.slice.contour_px);
        if let (Some(width), Some(level)) = (self.window, self.level) {
            let window = if scene.is_slice() { &mut scene.slice.window } else { &mut scene.window };
            *window = Some(Window { width, level });
        }
        scene.depth_cue = self.depth_cue.map_or(scene.depth_cue, |v| v as f32);
        Ok(())
    }

    fn apply_cuts(&self, scene: &mut Scene) -> Result<(), CommandError> {
        let count = scene.layers.len();
        for clip in self.clip.iter().chain(&self.crop).chain(&self.cylinder).chain(&self.sphere) {
            if let Some(n) = clip.layers.iter().flatten().find(|n| **n >= count) {
                return Err(no_volume(n + 1, count));
            }
            scene.clips.push(clip.clone());
        }
        Ok(())
    }

    /// A sentence for each option that changes nothing in a scene of such a mode.
    pub fn idle(&self, scene: &Scene) -> Vec<String> {
        let uses = |setting| scene.mode.uses(setting);
        let (dvr, numbers, shaded) = (uses(Setting::Transfer), uses(Setting::Numbers), uses(Setting::Shading));
        let (surfaces, shells) = (uses(Setting::Surfaces), uses(Setting::Shells));
        let cut = scene.has_cut_faces();
        let faces = cut && scene.cut_face != CutFace::Bone;
        let slice = scene.is_slice();
        let by_transfer = dvr || cut && scene.cut_face == CutFace::Transfer || slice && scene.slice.face == CutFace::Transfer;
        let steps = dvr && scene.integrator != Integrator::Exact;
        let options = [
            ("--shadows", self.shadows, surfaces),
            ("--shadow", self.shadow.is_some(), surfaces && scene.shadows),
            ("--light", self.light.is_some(), shaded),
            ("--phong", self.phong.is_some(), shaded),
            ("--opacity", !self.opacity.is_empty(), surfaces),
            ("--inner-color", !self.inner_color.is_empty(), shells),
            ("--shell", !self.shell.is_empty(), shells),
            ("--transfer", !self.transfer.is_empty(), by_transfer),
            ("--overall-opacity", !self.overall_opacity.is_empty(), by_transfer),
            ("--gradient-opacity", !self.gradient_opacity.is_empty(), dvr),
            ("--integrator", self.integrator.is_some(), dvr),
            ("--no-jitter", self.no_jitter, steps),
            ("--normals", self.normals.is_some(), shaded && scene.reconstructs() == Reconstruction::Trilinear),
            ("--gradient", self.gradient, numbers),
            ("--value-range", self.value_range.is_some(), numbers),
            ("--window and --level", self.window.is_some(), numbers || faces || slice && scene.slice.face != CutFace::Bone),
            ("--cut-face", self.cut_face.is_some(), cut || slice),
            ("--depth-range", self.depth_range.is_some(), uses(Setting::Depths)),
            ("--agree", self.agree.is_some(), uses(Setting::Agreement)),
            ("--thickness", self.thickness.is_some(), slice),
            ("--contour", self.contour.is_some(), slice),
            ("--depth-cue", self.depth_cue.is_some(), shaded),
        ];
        let idle = options.iter().filter(|(_, is_given, counts)| *is_given && !counts);
        let mut sentences: Vec<String> =
            idle.map(|(name, ..)| format!("{name} changes nothing here: see docs/modes.md for what uses it")).collect();
        let of_two = matches!(scene.cut_face, CutFace::Blend | CutFace::Difference);
        let is_cut = |n: usize| scene.layers[n].visible && scene.clips.iter().any(|clip| clip.cuts(n));
        if faces && of_two && (0..scene.layers.len()).filter(|n| is_cut(*n)).count() < 2 {
            sentences.push("--cut-face shows the density alone: blend and difference are of two scans that one cut goes through".into());
        }
        sentences
    }
}

/// Surfaces that are given an opacity, or company, show through.
fn show_through(scene: &mut Scene) {
    if scene.mode == Mode::Iso {
        scene.mode = Mode::Transparent;
    }
}

fn integrator(text: &str) -> Result<Integrator, String> {
    if text == "exact" {
        return Ok(Integrator::Exact);
    }
    let count = text.strip_prefix("steps:").and_then(|n| n.parse::<f32>().ok()).filter(|n| PER_VOXEL.contains(n));
    let steps = |per_voxel| Integrator::Steps { per_voxel, jitter: true };
    count.map(steps).ok_or_else(|| "neither `exact` nor `steps:N` with N from 0.01 to 1000 points in a voxel's length".into())
}

/// Factors of the opacity by the gradient.
#[derive(Clone, Debug)]
pub struct ByGradient(Vec<GradientPoint>);

fn by_gradient(text: &str) -> Result<ByGradient, String> {
    let point = |part: &str| {
        let (per_mm, factor) = part.split_once(':')?;
        let [per_mm, factor] = [per_mm, factor].map(|text| text.trim().parse::<f64>().ok().filter(|v| v.is_finite()));
        Some(GradientPoint { per_mm: per_mm?, factor: factor? })
    };
    let points = text.split(',').map(point).collect::<Option<Vec<_>>>();
    let points = points.ok_or("not factors by gradients such as 0:0,20:1")?;
    TransferFunction { gradient: points, ..TransferFunction::bone() }.checked().map(|function| ByGradient(function.gradient))
}

fn overall(text: &str) -> Result<f64, String> {
    text.parse().ok().filter(|v| OVERALL.contains(v)).ok_or_else(|| "not a factor from 0.001 to 1000".into())
}

fn direction(text: &str) -> Result<DVec3, String> {
    numbers::<3>(text).map(DVec3::from).ok().filter(|v| v.length() > 0.0).ok_or_else(|| "not a direction X,Y,Z".into())
}

fn phong(text: &str) -> Result<[f64; 4], String> {
    let is_sound = |[a, d, s, n]: &[f64; 4]| [a, d, s].iter().all(|part| (0.0..=1.0).contains(*part)) && (0.0..=1e4).contains(n);
    numbers(text).ok().filter(is_sound).ok_or_else(|| "not three parts from 0 to 1 and an exponent from 0 to 10000".into())
}

fn contour(text: &str) -> Result<f32, String> {
    let width = text.parse::<f32>().ok().filter(|width| (0.0..=WIDEST_CONTOUR_PX).contains(width));
    width.ok_or_else(|| format!("no width from 0 to {WIDEST_CONTOUR_PX} pixels"))
}

fn shell(text: &str) -> Result<(usize, Shell), String> {
    let parse = || {
        let (n, rest) = text.split_once(':')?;
        let [iso, color, opacity] = <[&str; 3]>::try_from(rest.split(',').collect::<Vec<_>>()).ok()?;
        let opacity = opacity.parse::<f32>().ok().filter(|o| (0.0..=1.0).contains(o))?;
        let iso = iso.parse::<f64>().ok().filter(|v| v.is_finite())?;
        Some((n.parse::<usize>().ok().filter(|n| *n > 0)?, Shell { iso, color: Color::from_hex(color)?, opacity }))
    };
    parse().ok_or_else(|| "not a volume's number, an isovalue, a colour and an opacity such as 1:-300,d9a184,0.25".into())
}

/// Numbers, and the layer that stands behind `@`.
fn placed<const N: usize>(text: &str, shape: impl Fn([f64; N]) -> Result<Shape, String>) -> Result<Clip, String> {
    let (text, layer) = match text.split_once('@') {
        Some((text, layer)) => {
            (text, Some(layer.parse::<usize>().ok().filter(|n| *n > 0).ok_or("@ needs the number of a volume, from 1")?))
        }
        None => (text, None),
    };
    let shape = shape(numbers::<N>(text)?)?;
    Ok(Clip { layers: layer.map(|n| vec![n - 1]), ..Clip::all(shape) })
}

fn plane(text: &str) -> Result<Clip, String> {
    placed(text, |[x, y, z, offset_mm]| match DVec3::new(x, y, z) {
        normal if normal.length() > 0.0 => Ok(Shape::Plane { normal: normal.normalize(), offset_mm: offset_mm / normal.length() }),
        _ => Err("a plane needs a normal that is not 0".into()),
    })
}

fn cuboid(text: &str) -> Result<Clip, String> {
    placed(text, |[x0, y0, z0, x1, y1, z1]| {
        let (low_mm, high_mm) = (DVec3::new(x0, y0, z0), DVec3::new(x1, y1, z1));
        if low_mm.cmplt(high_mm).all() {
            Ok(Shape::Box { low_mm, high_mm })
        } else {
            Err("its first corner is not below its second".into())
        }
    })
}

fn cylinder(text: &str) -> Result<Clip, String> {
    placed(text, |[x, y, z, dx, dy, dz, radius_mm]| match DVec3::new(dx, dy, dz).try_normalize() {
        Some(axis) if radius_mm > 0.0 => Ok(Shape::Cylinder { centre_mm: DVec3::new(x, y, z), axis, radius_mm }),
        _ => Err("a cylinder needs a direction and a positive radius".into()),
    })
}

fn sphere(text: &str) -> Result<Clip, String> {
    placed(text, |[x, y, z, radius_mm]| {
        if radius_mm > 0.0 {
            Ok(Shape::Sphere { centre_mm: DVec3::new(x, y, z), radius_mm })
        } else {
            Err("a sphere needs a positive radius".into())
        }
    })
}
