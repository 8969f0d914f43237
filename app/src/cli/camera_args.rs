//! What options say of where a picture is seen from.

use super::parsers::{Plane, field_of_view, pair, plane, point, positive};
use clap::Args;
use glam::DVec3;

/// The camera, LPS mm.
#[derive(Debug, Args)]
pub struct CameraArgs {
    /// Where the viewer stands
    #[arg(long, value_name = "X,Y,Z", value_parser = point, allow_hyphen_values = true, conflicts_with = "orbit")]
    pub eye: Option<DVec3>,
    /// What the centre of the picture shows; the middle of the scans when absent
    #[arg(long, value_name = "X,Y,Z", value_parser = point, allow_hyphen_values = true, requires = "eye")]
    pub target: Option<DVec3>,
    /// A direction that points up in the picture [default: 0,0,1]
    #[arg(long, value_name = "X,Y,Z", value_parser = point, allow_hyphen_values = true)]
    pub up: Option<DVec3>,
    /// Vertical field of view, degrees [default: 30]
    #[arg(long, value_name = "DEG", value_parser = field_of_view, conflicts_with = "ortho")]
    pub fov: Option<f64>,
    /// Parallel projection; height of the view, mm [default: what the target has in perspective]
    #[arg(long, value_name = "MM", num_args = 0..=1, value_parser = positive)]
    pub ortho: Option<Option<f64>>,
    /// Azimuth and elevation around the scans, degrees; 0,0 looks at the face, 90,0 at the left side
    #[arg(long, value_name = "AZ,EL", value_parser = pair, allow_hyphen_values = true)]
    pub orbit: Option<(f64, f64)>,
    /// Onto a plane, for --mode slice: axial, coronal or sagittal through the middle of the scans or, behind @, at a place along its axis (S, P
    /// or L, mm); or the plane n·x = D [default: axial]
    #[arg(long, value_name = "NAME[@MM]|NX,NY,NZ,D", value_parser = plane, allow_hyphen_values = true, conflicts_with_all = ["orbit", "eye", "fov"])]
    pub plane: Option<Plane>,
}
