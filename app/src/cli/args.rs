//! The command line: what is agreed in `bregma --help`.

use super::camera_args::CameraArgs;
use super::look::LookArgs;
use super::parsers::{
    Background, Seed, VolumeFile, background, ball, corners, disc, interval, number, one_of, pair, part, point, positive,
    registration_file, seed, size, solver, two_scans, volume_file,
};
use super::print_args::PrintArgs;
use super::sources::Sources;
use super::studio_args::StudioArgs;
use bregma_field::filters::MOST_RADIUS;
use bregma_measure::volumes::cavity::Disc;
use bregma_register::Part;
use bregma_renderer::{MOST_SAMPLES, Mode, Solver};

use bregma_session::film::QUALITY;
use bregma_session::register::By;
use bregma_session::thickness::ThicknessMethod;
use bregma_session::thickness_picture::Colors;
use bregma_session::{Compare, DEMO_SIZE, DifferenceBy, Machine};
use clap::{ArgGroup, Args, Parser, Subcommand, ValueEnum};
use glam::DVec3;
use std::path::PathBuf;

/// The whole command line.
#[derive(Debug, Parser)]
#[command(
    name = "bregma",
    version,
    about = "A workstation for people who compare scanned skulls",
    long_about = "A workstation for people who compare scanned skulls: exact isosurfaces of CT volumes, one over the other, and the \
                  length of every stretch of bone along a ray, with its error.\n\nWith files, or with nothing, it opens its window; \
                  without a file it shows a built-in pair of synthetic skulls.",
    after_help = "Examples:\n  bregma                                   the built-in pair\n  bregma skull.nrrd                        one scan\n  bregma --kiosk skull.nrrd                the picture alone, which turns by itself when left alone\n  bregma a.nii.gz --transform a-to-b.json b.nii.gz\n  bregma render skull.nrrd --iso 300 --orbit 30,15 --out skull.png"
)]
pub struct Cli {
    /// What to do; the window when absent.
    #[command(subcommand)]
    pub command: Option<Command>,
    /// Scans to open in the window.
    #[command(flatten)]
    pub sources: Sources<0>,
    /// Fill the screen with the picture; left alone for so many seconds (30, or as chosen in the window), it turns by itself
    #[arg(long, value_name = "SECONDS", num_args = 0..=1, require_equals = true, value_parser = positive)]
    pub kiosk: Option<Option<f64>>,
    /// Options for all.
    #[command(flatten)]
    pub common: Common,
}

/// Options for every command.
#[derive(Clone, Debug, Args)]
pub struct Common {
    /// What draws; auto is a hardware GPU if there is one, else the CPU
    #[arg(long, value_parser = one_of::<Machine>(), default_value = "auto", global = true)]
    pub backend: Machine,
    /// CPU threads; all cores when absent
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=1024), global = true)]
    pub threads: Option<u16>,
}

/// What to do.
#[derive(Debug, Subcommand)]
pub enum Command {
    /// Write the synthetic pair, a session, a picture of each mode and a probe
    #[command(after_help = "Example:\n  bregma demo --out bregma-demo")]
    Demo(DemoArgs),
    /// Say what a scan is
    #[command(after_help = "Examples:\n  bregma info skull.nrrd\n  bregma info --json *.nii.gz")]
    Info(InfoArgs),
    /// Write a scan in another form
    #[command(
        after_help = "The name of OUT says the form: .nrrd, .nii, .nii.gz, .mha, .tif or .ome.zarr, into which scans larger than memory go, too.\n\nExamples:\n  bregma convert dicom-folder skull.nrrd\n  bregma convert study#201 skull.nii.gz\n  bregma convert slices --spacing 0.05,0.05,0.05 skull.mha\n  bregma convert large.vol large.ome.zarr --surfaces 150..400"
    )]
    Convert(ConvertArgs),
    /// Draw one picture
    #[command(
        after_help = "Examples:\n  bregma render skull.nrrd --iso 300 --out skull.png\n  bregma render a.nii.gz --transform a-to-b.json b.nii.gz --mode overlay --orbit 40,10 --size 1600x1200 --out pair.png\n  bregma render skull.nrrd --eye 0,-600,0 --target 0,0,0 --fov 25 --depth depth.npy --out skull.png\n  bregma render skull.nrrd points.mrk.json --view frontalis --frankfurt --print 85x100 --dpi 600 --bar 50 --letters --label A --out fig1.tif\n  bregma render skull.nrrd --plate frontalis,lateralis-sinistra,verticalis --print 180x70 --bar auto --label A --out fig2.pdf"
    )]
    Render(Box<RenderArgs>),
    /// Make a film: a turntable, or what goes from key to key
    #[command(
        after_help = "What options of a picture say (bregma render) holds for each frame. A key says from where (camera, orbit), iso, opacity, cut_offsets_mm, light, swipe; what it leaves out goes on. Frames are kept in F.mp4.frames until the film is whole: stopped, the same command goes on.\n\nExamples:\n  bregma film skull.nrrd --turntable 12 --out skull.mp4\n  bregma film a.nrrd b.nrrd --mode overlay --turntable 8 --size 1920x1080 --bar auto --bar-at target --out pair.mp4\n  bregma film skull.nrrd --keys tour.json --shadows --samples 4 --out tour.apng"
    )]
    Film(Box<FilmArgs>),
    /// Cast the difference ray: crossings, bone segments and their lengths
    #[command(
        after_help = "Examples:\n  bregma probe a.nrrd b.nrrd --iso 226 --origin 0,-200,40 --direction 0,1,0\n  bregma probe skull.nrrd --origin 0,-200,40 --toward 0,0,40 --format json\n  bregma probe skull.nrrd --rays rays.csv --format csv"
    )]
    Probe(ProbeArgs),
    /// Measure again what a session or an export records, or draw a picture again, and say what still holds
    #[command(
        after_help = "Examples:\n  bregma verify fig1.tif\n  bregma probe skull.nrrd --origin 0,-200,40 --toward 0,0,40 --format json >ray.json\n  bregma verify ray.json"
    )]
    Verify(VerifyArgs),
    /// Map how thick the bone is over the whole surface: CSV, PLY, JSON and a picture
    #[command(
        after_help = "Examples:\n  bregma thickness skull.nrrd --iso 300 --out thickness\n  bregma thickness skull.nrrd --method sphere --range 0,12 --orbit 90,10 --out thickness\n  bregma thickness skull.nrrd --method ray --direction 0,0,-1 --patch 3,-80,60,25 --out vertex"
    )]
    Thickness(ThicknessArgs),
    /// How two scans differ over their whole surfaces, where, by how much, how sure: pictures, tables, coloured surfaces, a report
    #[command(
        after_help = "Examples:\n  bregma register a.nrrd b.nrrd --out a-to-b.json\n  bregma difference a.nrrd b.nrrd --transform a-to-b.json --out difference\n  bregma difference a.nrrd b.nrrd --by thickness --only 0,-80,60,40 --out frontal\n  bregma difference skull.nrrd --by asymmetry --range 2 --isolines 0.5 --out sides\n  bregma difference a.nrrd b.nrrd --by displacement --only 0,-50,-110,45 --out jaw\n  bregma difference mean.nrrd *.nii.gz --each --range 1.5 --out all"
    )]
    Difference(Box<DifferenceArgs>),
    /// Thickness along a curve of the surface, of one scan or of two, and how they differ, each with its ±: chart, table, record
    #[command(
        after_help = "The curve runs on the first scan. Landmarks stand among the files. --through goes from landmark to landmark, --plane and --plane-at along a whole curve of a plane. The name of OUT says the form: .png or .svg (chart), .csv (table) or .json (record, for `bregma verify`).\n\nExamples:\n  bregma section skull.nrrd skull.mrk.json --through nasion,bregma,lambda,opisthion --out vault.png --out vault.csv\n  bregma section a.nrrd a.mrk.json b.nrrd --transform b-to-a.json --through nasion,bregma,lambda --out vault.svg\n  bregma section a.nrrd --plane-at 0,0,40 --normal 0,0,1 --step 0.5 --out ring.csv"
    )]
    Section(Box<SectionArgs>),
    /// Measure the volume of bone, of what two scans share, and of cavities
    #[command(
        after_help = "Without --cavity the bone is measured: of one scan, or of two, what both share and what each has alone. With --cavity what is reached from a point through empty space.\n\nExamples:\n  bregma volume skull.nrrd --iso 300\n  bregma volume a.nrrd --transform a-to-b.json b.nrrd --box -40,-100,-40,40,-60,0 --out volumes.csv\n  bregma volume skull.nrrd --cavity 0,0,20 --sphere-passes 3 --close 0,28,-60,0,0,1,20 --out endocranium.json"
    )]
    Volume(VolumeArgs),
    /// Find the parts of a scan: islands of bone, bones that hang together by necks, the skull without what it lies on; as a table and a label map
    #[command(
        after_help = "The name of OUT says the form: .seg.nrrd (a segmentation of 3D Slicer, with names and colours), .nii.gz or any other that scans are written in (numbers).\n\nExamples:\n  bregma parts skull.nrrd --keep-the-skull --out skull.seg.nrrd\n  bregma parts skull.nrrd --separate 3 --out bones.seg.nrrd\n  bregma parts mouse.nii.gz --islands --larger-than 1 --iso 40 --out islands.seg.nrrd\n  bregma parts skull.nrrd --labels bones.seg.nrrd"
    )]
    Parts(PartsArgs),
    /// Filter a scan into one of its own
    #[command(
        after_help = "The name of OUT says the form: .nrrd, .nii, .nii.gz, .mha or .tif.\n\nExamples:\n  bregma filter skull.nrrd --gaussian 0.5 --out smooth.nrrd\n  bregma filter skull.nrrd --median 1 --out median.nii.gz\n  bregma filter skull.nrrd --diffuse 5,1 --out diffused.nrrd"
    )]
    Filter(FilterArgs),
    /// Move one scan onto another, and say how sure that is
    #[command(
        after_help = "The first scan is moved onto the second. The name of OUT says the form: .json (with how sure it is, and what it was made from, for `bregma verify`), .tfm, .txt or .h5 (ITK, 3D Slicer).\n\nExamples:\n  bregma register a.nii.gz b.nii.gz --out a-to-b.json\n  bregma register a.nii.gz b.nii.gz --landmarks a.mrk.json b.mrk.json --by landmarks --out a-to-b.tfm\n  bregma register a.nrrd b.nrrd --only 0,-80,40,60 --out face.json"
    )]
    Register(Box<RegisterArgs>),
    /// Hold one scan in the Frankfurt horizontal, or about its plane of symmetry
    #[command(
        after_help = "Landmarks stand among the files. Frankfurt's plane goes through porion left, porion right and orbitale left; the right orbitale is told. The plane of symmetry is that about which the surface is most like its mirror image; where points of the midline are named, the angle to their plane is told.\n\nExamples:\n  bregma orient skull.nrrd skull.mrk.json --out level.json\n  bregma orient skull.nrrd --by symmetry --out upright.json --mirror-out mirrored.json\n  bregma render skull.nrrd skull.nrrd --transform mirrored.json --mode overlay --out both-sides.png\n  bregma render skull.nrrd --transform level.json --out skull.png"
    )]
    Orient(OrientArgs),
    /// Failure rates of every solver over the hard families: stability.csv, stability.md
    #[command(after_help = "Example:\n  bregma stability --out stability")]
    Stability(StabilityArgs),
    /// Time the orbit
    #[command(after_help = "Example:\n  bregma bench skull.nrrd --iso 300 --json")]
    Bench(Box<BenchArgs>),
    /// Speed against accuracy of every solver (chart, and a picture of each one's errors), of the integrators of dvr (integrals), and of
    /// gradients on the demo's phantom (normals): each .csv, .svg and .png
    #[command(after_help = "Examples:\n  bregma chart skull.nrrd --iso 300 --out chart\n  bregma chart --backend cpu --out chart")]
    Chart(ChartArgs),
}

/// `bregma demo`.
#[derive(Debug, Args)]
pub struct DemoArgs {
    /// Folder to write into; made if it is not there
    #[arg(long, value_name = "DIR")]
    pub out: PathBuf,
    /// Samples along the longest side
    #[arg(long, value_name = "N", default_value_t = DEMO_SIZE as u16, value_parser = clap::value_parser!(u16).range(2..=2048))]
    pub size: u16,
}

/// `bregma info`.
#[derive(Debug, Args)]
pub struct InfoArgs {
    /// The scans.
    #[command(flatten)]
    pub sources: Sources<1>,
    /// One JSON object for each file, a line each
    #[arg(long)]
    pub json: bool,
}

/// `bregma convert`.
#[derive(Debug, Args)]
pub struct ConvertArgs {
    /// The scan, and the file to write.
    #[command(flatten)]
    pub files: Sources<2>,
    /// Keep only what surfaces of isovalues from LO to HI need, exactly; elsewhere samples become constant (.ome.zarr)
    #[arg(long, value_name = "LO..HI", value_parser = interval, allow_hyphen_values = true)]
    pub surfaces: Option<[f64; 2]>,
    /// Round samples, so that no value is farther off than D (.ome.zarr)
    #[arg(long, value_name = "D", value_parser = number, allow_hyphen_values = true, default_value_t = 0.0, hide_default_value = true)]
    pub error: f64,
}

/// Isovalues.
#[derive(Debug, Args)]
pub struct Isovalues {
    /// Isovalue in the scan's values (HU where the file says so): once for all volumes, or once for each in order; bone in HU,
    /// else Otsu's threshold, when absent
    #[arg(long, value_name = "V", value_parser = number, allow_hyphen_values = true, value_delimiter = ',')]
    pub iso: Vec<f64>,
}

/// `bregma render`.
#[derive(Debug, Args)]
pub struct RenderArgs {
    /// The scans.
    #[command(flatten)]
    pub sources: Sources<0>,
    /// The picture: .png, .tif, .exr, .jpg, .pdf or .svg
    #[arg(long, value_name = "P.png")]
    pub out: PathBuf,
    /// Isovalues.
    #[command(flatten)]
    pub isovalues: Isovalues,
    /// How surfaces are put together
    #[arg(long, value_parser = one_of::<Mode>())]
    pub mode: Option<Mode>,
    /// Pixels [default: 512x512]
    #[arg(long, value_name = "WxH", value_parser = size)]
    pub size: Option<(u32, u32)>,
    /// Points of each pixel whose light is averaged: edges without steps; depths and values stay those of the pixels' middles [default: 1, of
    /// prints 16, with --studio 64]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=i64::from(MOST_SAMPLES)))]
    pub samples: Option<u32>,
    /// Studio light.
    #[command(flatten)]
    pub studio: StudioArgs,
    /// How roots are found: exact [default], linear, neubauer[:2|3|4], marmitt[:2|3|4], analytic, step:1|0.5|0.25|0.125, filter (GPU)
    #[arg(long, value_name = "NAME", value_parser = solver)]
    pub solver: Option<Solver>,
    /// How the scene looks.
    #[command(flatten)]
    pub look: LookArgs,
    /// Two scans in two pictures of one view: beside each other, left and right of a line, or by turns as on a chessboard
    #[arg(long, value_name = "side|swipe:PART|checker:N")]
    pub compare: Option<Compare>,
    /// Which two scans --compare is of, by their numbers from 1 [default: the first two]
    #[arg(long, value_name = "N,M", value_parser = two_scans, requires = "compare")]
    pub pair: Option<[usize; 2]>,
    /// Behind the bone: RRGGBB, white, or clear (transparent) [default: dark, of prints white]
    #[arg(long, visible_alias = "ground", value_name = "HEX|white|clear", value_parser = background)]
    pub background: Option<Background>,
    /// The camera.
    #[command(flatten)]
    pub camera: CameraArgs,
    /// On paper.
    #[command(flatten)]
    pub print: PrintArgs,
    /// Distance along each pixel's ray to the first surface drawn, mm: NPY float32, NaN where none
    #[arg(long, value_name = "P.npy")]
    pub depth: Option<PathBuf>,
    /// Number of the volume that is drawn in each pixel, from 1: NPY uint8, 0 where none
    #[arg(long, value_name = "P.npy")]
    pub volume_id: Option<PathBuf>,
    /// What max, min, mean, xray or slice (of its first scan) has in each pixel: NPY float32, NaN where none
    #[arg(long, value_name = "P.npy")]
    pub values: Option<PathBuf>,
}

/// `bregma film`.
#[derive(Debug, Args)]
#[command(mut_arg("out", |out| out.value_name("F.mp4").help("The film: .mp4, .apng, .gif, or a folder for its frames")))]
#[command(mut_arg("size", |size| size.help("Pixels [default: 1280x720]")))]
pub struct FilmArgs {
    /// What it shows.
    #[command(flatten)]
    pub picture: RenderArgs,
    /// Once around the vertical of the view in so many seconds
    #[arg(long, value_name = "SECONDS", value_parser = positive, conflicts_with = "seconds")]
    pub turntable: Option<f64>,
    /// How often around, of a turntable; backward where negative
    #[arg(long, value_name = "N", value_parser = number, allow_hyphen_values = true, default_value = "1", requires = "turntable")]
    pub turns: f64,
    /// What is to be seen when: JSON, {"keys": [{"at_s": 0, "orbit": [0, 10], "iso": [300], ...}]}
    #[arg(long, value_name = "FILE.json")]
    pub keys: Option<PathBuf>,
    /// How long it runs, of keys [default: until the last key]
    #[arg(long, value_name = "SECONDS", value_parser = positive)]
    pub seconds: Option<f64>,
    /// Frames in a second [default: 30, or those of a session's film]
    #[arg(long, value_name = "N", value_parser = positive)]
    pub fps: Option<f64>,
    /// How coarsely MP4 keeps frames: 0 is best and largest, 51 worst
    #[arg(long, value_name = "Q", value_parser = clap::value_parser!(u8).range(0..=51), default_value_t = QUALITY)]
    pub quantiser: u8,
}

/// `bregma probe`.
#[derive(Debug, Args)]
pub struct ProbeArgs {
    /// The scans.
    #[command(flatten)]
    pub sources: Sources<1>,
    /// Isovalues.
    #[command(flatten)]
    pub isovalues: Isovalues,
    /// Where the ray begins, LPS mm
    #[arg(long, value_name = "X,Y,Z", value_parser = point, allow_hyphen_values = true, required_unless_present = "rays")]
    pub origin: Option<DVec3>,
    /// Where it goes
    #[arg(long, value_name = "X,Y,Z", value_parser = point, allow_hyphen_values = true, required_unless_present_any = ["toward", "rays"])]
    pub direction: Option<DVec3>,
    /// A point that it goes toward, LPS mm
    #[arg(long, value_name = "X,Y,Z", value_parser = point, allow_hyphen_values = true, conflicts_with = "direction")]
    pub toward: Option<DVec3>,
    /// Many rays: CSV with the header ox,oy,oz,dx,dy,dz, mm, or name,ox,oy,oz,dx,dy,dz
    #[arg(long, value_name = "FILE.csv", conflicts_with_all = ["origin", "direction", "toward"])]
    pub rays: Option<PathBuf>,
    /// Measure only what a session's cuts leave; else the whole bone is measured, whatever is cut to look at it
    #[arg(long)]
    pub as_cut: bool,
    /// Form of the answer
    #[arg(long, value_enum, default_value = "table")]
    pub format: ProbeFormat,
}

/// Form of a probe's answer.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum ProbeFormat {
    /// For reading.
    Table,
    /// Everything; one object a line for many rays.
    Json,
    /// A tidy table: a row for each difference, bone segment and stretch of the ledger.
    Csv,
    /// 3D Slicer's markups JSON, one Line for each bone segment.
    Markups,
}

/// `bregma verify`.
#[derive(Debug, Args)]
pub struct VerifyArgs {
    /// Sessions, what `bregma probe --format json` wrote, or pictures that `bregma render` wrote
    #[arg(value_name = "FILE", required = true)]
    pub files: Vec<PathBuf>,
    /// Tell also those that hold
    #[arg(long)]
    pub all: bool,
}

/// `bregma register`.
#[derive(Debug, Args)]
pub struct RegisterArgs {
    /// The scan that is moved, and the one that stays.
    #[command(flatten)]
    pub sources: Sources<2>,
    /// Isovalues.
    #[command(flatten)]
    pub isovalues: Isovalues,
    /// The registration
    #[arg(long, value_name = "OUT", value_parser = registration_file)]
    pub out: PathBuf,
    /// By what: points of the same names, surfaces, or from there the values around them, of one object scanned twice
    #[arg(long, value_parser = one_of::<By>(), default_value = "surfaces")]
    pub by: By,
    /// Landmarks of the moved scan and of the other; surfaces begin where they lead
    #[arg(long, num_args = 2, value_names = ["MOVED", "STAYS"])]
    pub landmarks: Vec<PathBuf>,
    /// Landmarks that take no part
    #[arg(long, value_name = "NAME")]
    pub leave_out: Vec<String>,
    /// Let landmarks change the size, too
    #[arg(long, conflicts_with = "affine")]
    pub similarity: bool,
    /// Let landmarks stretch and shear, too
    #[arg(long)]
    pub affine: bool,
    /// Only the surface within a ball (centre and radius) or a box (two opposite corners: X,Y,Z,X,Y,Z) of the scan that stays, mm; several are
    /// united
    #[arg(long, value_name = "X,Y,Z,R", value_parser = part, allow_hyphen_values = true)]
    pub only: Vec<Part>,
    /// Without the surface within a ball or a box of the scan that stays
    #[arg(long, value_name = "X,Y,Z,R", value_parser = part, allow_hyphen_values = true)]
    pub but: Vec<Part>,
    /// Look for the pose of surfaces anywhere, not first where the files put the scans
    #[arg(long)]
    pub anywhere: bool,
}

/// By what a scan is held.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum OrientBy {
    /// Both poria and the left orbitale
    Frankfurt,
    /// The surface and its mirror image
    Symmetry,
}

/// `bregma orient`.
#[derive(Debug, Args)]
pub struct OrientArgs {
    /// The scan, and its landmarks.
    #[command(flatten)]
    pub sources: Sources<1>,
    /// Isovalues.
    #[command(flatten)]
    pub isovalues: Isovalues,
    /// The pose, as a registration
    #[arg(long, value_name = "OUT", value_parser = registration_file)]
    pub out: PathBuf,
    /// By what
    #[arg(long, value_enum, default_value = "frankfurt")]
    pub by: OrientBy,
    /// By symmetry: also the registration that lays the scan's mirror image onto the scan, so that one side stands for the other
    #[arg(long, value_name = "OUT", value_parser = registration_file)]
    pub mirror_out: Option<PathBuf>,
    /// Standard deviation of each coordinate of a landmark, mm, for the ± of the turns
    #[arg(long, value_name = "MM", default_value_t = 1.0, value_parser = positive)]
    pub pick_error: f64,
}

/// `bregma thickness`.
#[derive(Debug, Args)]
pub struct ThicknessArgs {
    /// The scan.
    #[command(flatten)]
    pub sources: Sources<1>,
    /// Isovalues.
    #[command(flatten)]
    pub isovalues: Isovalues,
    /// Folder to write into; made if it is not there
    #[arg(long, value_name = "DIR")]
    pub out: PathBuf,
    /// Which thickness: along a ray, along the inward normal, or of the largest inscribed sphere
    #[arg(long, value_parser = one_of::<ThicknessMethod>(), default_value = "normal")]
    pub method: ThicknessMethod,
    /// Of the rays, into the bone
    #[arg(long, value_name = "X,Y,Z", value_parser = point, allow_hyphen_values = true, required_if_eq("method", "ray"))]
    pub direction: Option<DVec3>,
    /// Map only what a session's cuts leave of the surface; thickness is that of the whole bone all the same
    #[arg(long)]
    pub as_cut: bool,
    /// Only within R mm of a point
    #[arg(long, value_name = "X,Y,Z,R", value_parser = ball, allow_hyphen_values = true)]
    pub patch: Option<(DVec3, f64)>,
    /// Ends of the colours, mm; what 95 % of the surface has when absent
    #[arg(long, value_name = "LOW,HIGH", value_parser = pair)]
    pub range: Option<(f64, f64)>,
    /// Colours
    #[arg(long, value_parser = one_of::<Colors>(), default_value = "viridis")]
    pub colors: Colors,
    /// Pixels of the picture
    #[arg(long, value_name = "WxH", value_parser = size, default_value = "800x800")]
    pub size: (u32, u32),
    /// The camera.
    #[command(flatten)]
    pub camera: CameraArgs,
}

/// `bregma difference`.
#[derive(Debug, Args)]
pub struct DifferenceArgs {
    /// The scans, the second against the first.
    #[command(flatten)]
    pub sources: Sources<2>,
    /// Isovalues.
    #[command(flatten)]
    pub isovalues: Isovalues,
    /// Folder to write into; made if it is not there
    #[arg(long, value_name = "DIR")]
    pub out: PathBuf,
    /// Which difference: to the nearest place that faces the same way, to the nearest of any sheet, along the normal, of the thickness, how far a
    /// part (--only) moved as a whole, or to the scan's own mirror image
    #[arg(long, value_parser = one_of::<DifferenceBy>(), default_value = "partner")]
    pub by: DifferenceBy,
    /// Many scans: each other one against the first, each into a folder of its own in DIR, with one table.csv and one sheet.png; what stands there
    /// already is not measured again
    #[arg(long)]
    pub each: bool,
    /// The same of all pairs
    #[arg(long, conflicts_with = "each")]
    pub all_pairs: bool,
    /// What belongs to a point is looked for so far, mm; a twentieth of the scan's radius, rounded up, when absent
    #[arg(long, value_name = "MM", value_parser = positive)]
    pub reach: Option<f64>,
    /// End of the colours, mm, the other being its negative; what 95 % of the surface stays below when absent
    #[arg(long, value_name = "MM", value_parser = positive)]
    pub range: Option<f64>,
    /// Lines of equal difference so far apart
    #[arg(long, value_name = "MM", value_parser = positive)]
    pub isolines: Option<f64>,
    /// Colour what lies within its ±, too, which is grey else
    #[arg(long)]
    pub all_colors: bool,
    /// Only the surface within a ball (centre and radius) or a box (two opposite corners: X,Y,Z,X,Y,Z), mm; several are united
    #[arg(long, value_name = "X,Y,Z,R", value_parser = part, allow_hyphen_values = true)]
    pub only: Vec<Part>,
    /// Without the surface within a ball or a box
    #[arg(long, value_name = "X,Y,Z,R", value_parser = part, allow_hyphen_values = true)]
    pub but: Vec<Part>,
    /// Only what a session's cuts leave of the surfaces; distances are those of the whole bone all the same
    #[arg(long)]
    pub as_cut: bool,
    /// Pixels of the pictures
    #[arg(long, value_name = "WxH", value_parser = size, default_value = "800x800")]
    pub size: (u32, u32),
    /// The camera.
    #[command(flatten)]
    pub camera: CameraArgs,
}

/// `bregma section`.
#[derive(Debug, Args)]
#[command(group = ArgGroup::new("path").required(true).args(["through", "plane", "plane_at"]))]
pub struct SectionArgs {
    /// One scan or two, and landmarks.
    #[command(flatten)]
    pub sources: Sources<1>,
    /// Isovalues.
    #[command(flatten)]
    pub isovalues: Isovalues,
    /// More landmarks
    #[arg(long, value_name = "FILE")]
    pub landmarks: Vec<PathBuf>,
    /// From landmark to landmark, by their names: two or more. Between two of them the curve lies in the plane of both and of the mean of the surface's
    /// normals there, and is the shorter way
    #[arg(long, value_name = "NAME,NAME,…", value_delimiter = ',')]
    pub through: Vec<String>,
    /// With --through: in one plane, that of three landmarks, or of least squares through more
    #[arg(long, requires = "through")]
    pub one_plane: bool,
    /// A whole curve of the plane of three landmarks, or of least squares through more: mid-sagittal by nasion,bregma,opisthion
    #[arg(long, value_name = "NAME,NAME,NAME", value_delimiter = ',')]
    pub plane: Vec<String>,
    /// A whole curve of the plane through a point, LPS mm
    #[arg(long, value_name = "X,Y,Z", value_parser = point, allow_hyphen_values = true, requires = "normal")]
    pub plane_at: Option<DVec3>,
    /// The direction that this plane is square to
    #[arg(long, value_name = "X,Y,Z", value_parser = point, allow_hyphen_values = true, requires = "plane_at")]
    pub normal: Option<DVec3>,
    /// Of a plane's curves the one at this landmark, from there on; else the longest that no other goes round
    #[arg(long, value_name = "NAME", conflicts_with = "through")]
    pub seed: Option<String>,
    /// From station to station along the curve, mm
    #[arg(long, value_name = "MM", value_parser = positive, default_value_t = 1.0)]
    pub step: f64,
    /// What belongs to a station on the second scan is looked for so far, mm; a twentieth of the scan's radius, rounded up, when absent
    #[arg(long, value_name = "MM", value_parser = positive)]
    pub reach: Option<f64>,
    /// The chart (.png, .svg), the table (.csv) or the record (.json); several may be named
    #[arg(long, value_name = "OUT", required = true)]
    pub out: Vec<PathBuf>,
}

/// `bregma volume`.
#[derive(Debug, Args)]
pub struct VolumeArgs {
    /// One scan, or two; landmarks may stand among them.
    #[command(flatten)]
    pub sources: Sources<1>,
    /// Isovalues.
    #[command(flatten)]
    pub isovalues: Isovalues,
    /// Measure the cavity around a point, LPS mm, or around a landmark by its name
    #[arg(long = "cavity", value_name = "X,Y,Z|NAME", value_parser = seed, allow_hyphen_values = true)]
    pub cavities: Vec<Seed>,
    /// The cavity ends where a ball of this radius does not pass any more, mm
    #[arg(long, value_name = "R", value_parser = positive, requires = "cavities")]
    pub sphere_passes: Option<f64>,
    /// Close an opening of the cavity by a disc: its middle, its normal and its radius, mm
    #[arg(long, value_name = "X,Y,Z,NX,NY,NZ,R", value_parser = disc, allow_hyphen_values = true, requires = "cavities")]
    pub close: Vec<Disc>,
    /// Measure only what lies in a box, by two opposite corners, LPS mm
    #[arg(long = "box", value_name = "X,Y,Z,X,Y,Z", value_parser = corners, allow_hyphen_values = true)]
    pub boxes: Vec<[DVec3; 2]>,
    /// Measure only what lies in a sphere
    #[arg(long = "sphere", value_name = "X,Y,Z,R", value_parser = ball, allow_hyphen_values = true)]
    pub spheres: Vec<(DVec3, f64)>,
    /// Close bone and cavities at the scan's box where that cuts them, instead of refusing them
    #[arg(long)]
    pub open: bool,
    /// Also write the volumes: a table, or a record for `bregma verify`
    #[arg(long, value_name = "FILE.csv|.json", value_parser = volume_file)]
    pub out: Option<VolumeFile>,
    /// Print the record instead of a table
    #[arg(long)]
    pub json: bool,
}

/// `bregma parts`.
#[derive(Debug, Args)]
#[command(group = ArgGroup::new("way").required(true).args(["largest", "islands", "at", "separate", "keep_the_skull", "labels", "seeds", "surface"]))]
pub struct PartsArgs {
    /// The scan.
    #[command(flatten)]
    pub sources: Sources<1>,
    /// Isovalues.
    #[command(flatten)]
    pub isovalues: Isovalues,
    /// The largest island of bone
    #[arg(long)]
    pub largest: bool,
    /// All islands
    #[arg(long)]
    pub islands: bool,
    /// The island that a point lies in, LPS mm
    #[arg(long, value_name = "X,Y,Z", value_parser = point, allow_hyphen_values = true)]
    pub at: Option<DVec3>,
    /// Bones apart at necks that are not thicker, mm
    #[arg(long, value_name = "MM", value_parser = positive)]
    pub separate: Option<f64>,
    /// The skull without the head rest, the table or the arm that hangs on it
    #[arg(long)]
    pub keep_the_skull: bool,
    /// The parts of a label map: a segmentation of 3D Slicer, or an image of whole numbers
    #[arg(long, value_name = "FILE")]
    pub labels: Option<PathBuf>,
    /// Let two or more parts of a label map that are painted on bone grow through it until they meet
    #[arg(long, value_name = "FILE")]
    pub seeds: Option<PathBuf>,
    /// What lies within a closed surface, PLY or STL in LPS mm; once for each part
    #[arg(long, value_name = "FILE")]
    pub surface: Vec<PathBuf>,
    /// Smooth the borders between parts that touch, as far as a ball of this radius would vanish, mm
    #[arg(long, value_name = "MM", value_parser = positive)]
    pub smooth: Option<f64>,
    /// Only parts of at least this volume, mm³; with --separate smaller ones go with their neighbours [default: all; with --separate a hundredth of
    /// the bone]
    #[arg(long, value_name = "MM3", value_parser = positive)]
    pub larger_than: Option<f64>,
    /// The label map
    #[arg(long, value_name = "OUT")]
    pub out: Option<PathBuf>,
    /// Print one JSON object instead of a table
    #[arg(long)]
    pub json: bool,
}

/// `bregma filter`.
#[derive(Debug, Args)]
#[command(group = ArgGroup::new("what").required(true).args(["gaussian", "median", "diffuse"]))]
pub struct FilterArgs {
    /// The scan.
    #[command(flatten)]
    pub sources: Sources<1>,
    /// Weighted means by a Gaussian of this standard deviation, mm
    #[arg(long, value_name = "MM", value_parser = positive)]
    pub gaussian: Option<f64>,
    /// Medians of all samples within so many along each axis
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u8).range(1..=MOST_RADIUS as i64))]
    pub median: Option<u8>,
    /// Diffusion that stops at edges: iterations, conductance [default: 1] and time step [default: the shortest spacing in mm / 16, the longest that is stable]
    #[arg(long, value_name = "N,C,T", value_parser = positive, value_delimiter = ',')]
    pub diffuse: Vec<f64>,
    /// The scan to write
    #[arg(long, value_name = "OUT")]
    pub out: PathBuf,
}

/// `bregma bench`.
#[derive(Debug, Args)]
pub struct BenchArgs {
    /// The scans.
    #[command(flatten)]
    pub sources: Sources<1>,
    /// Isovalues.
    #[command(flatten)]
    pub isovalues: Isovalues,
    /// How surfaces are put together
    #[arg(long, value_parser = one_of::<Mode>(), default_value = "iso")]
    pub mode: Mode,
    /// How roots are found: exact, linear, neubauer[:2|3|4], marmitt[:2|3|4], analytic, step:1|0.5|0.25|0.125, filter (GPU)
    #[arg(long, value_name = "NAME", value_parser = solver, default_value = "exact")]
    pub solver: Solver,
    /// Pixels along each side
    #[arg(long, value_name = "N", default_value_t = 512, value_parser = clap::value_parser!(u32).range(1..=16384))]
    pub size: u32,
    /// How the scene looks.
    #[command(flatten)]
    pub look: LookArgs,
    /// Frames of the orbit
    #[arg(long, value_name = "N", default_value_t = 8, value_parser = clap::value_parser!(u32).range(1..=10_000))]
    pub frames: u32,
    /// One JSON object
    #[arg(long)]
    pub json: bool,
}

/// `bregma chart`.
#[derive(Debug, Args)]
pub struct ChartArgs {
    /// The scans; the built-in pair when absent.
    #[command(flatten)]
    pub sources: Sources<0>,
    /// Isovalues.
    #[command(flatten)]
    pub isovalues: Isovalues,
    /// Folder to write into; made if it is not there
    #[arg(long, value_name = "DIR")]
    pub out: PathBuf,
    /// Pixels along each side
    #[arg(long, value_name = "N", default_value_t = 512, value_parser = clap::value_parser!(u32).range(1..=4096))]
    pub size: u32,
    /// Frames of the orbit
    #[arg(long, value_name = "N", default_value_t = 8, value_parser = clap::value_parser!(u32).range(1..=1000))]
    pub frames: u32,
    /// Times that each frame is timed
    #[arg(long, value_name = "N", default_value_t = 3, value_parser = clap::value_parser!(u32).range(1..=1000))]
    pub rounds: u32,
}

/// `bregma stability`.
#[derive(Debug, Args)]
pub struct StabilityArgs {
    /// Folder to write into; made if it is not there
    #[arg(long, value_name = "DIR")]
    pub out: PathBuf,
}
