//! Colours as a printer's inks, by a profile whose answers are known.

use super::folder;
use bregma_renderer::Color;
use bregma_session::print::{Canvas, Encoding, Form, Inks, write};
use std::io::Cursor;
use std::path::PathBuf;
use tiff::decoder::DecodingResult;
use tiff::tags::Tag;

/// A profile of a printer that has only black ink, by lightness: K = 1 − L/100. Its table has two points along each axis of Lab; written by hand from
/// the ICC's specification (`mft2`, 10.10 of ICC.1:2010), so that no library's own idea of one is tested with itself.
fn black_ink() -> PathBuf {
    let words = |words: &[u16]| words.iter().flat_map(|w| w.to_be_bytes()).collect::<Vec<u8>>();
    let mut table = b"mft2\0\0\0\0".to_vec();
    // From three channels to four, two points along each; no matrix; two entries in each curve.
    table.extend([3, 4, 2, 0]);
    let one = 65536_u32;
    table.extend([one, 0, 0, 0, one, 0, 0, 0, one].iter().flat_map(|v| v.to_be_bytes()));
    table.extend(words(&[2, 2]));
    table.extend(words(&[0, 65535].repeat(3)));
    // The first channel, lightness, varies least quickly.
    for lightness in [0, 1] {
        for _ in 0..4 {
            table.extend(words(&[0, 0, 0, if lightness == 0 { 65535 } else { 0 }]));
        }
    }
    table.extend(words(&[0, 65535].repeat(4)));
    let mut profile = vec![0; 128];
    profile[8] = 2;
    profile[12..24].copy_from_slice(b"prtrCMYKLab ");
    profile[36..40].copy_from_slice(b"acsp");
    let white = [0.9642, 1.0, 0.8249].map(|v: f64| (v * 65536.0).round() as u32);
    profile[68..80].copy_from_slice(&white.map(u32::to_be_bytes).concat());
    // Perceptual and relative to the paper: the same.
    profile.extend(2_u32.to_be_bytes());
    for tag in [b"B2A0", b"B2A1"] {
        profile.extend(tag);
        profile.extend([156_u32, table.len() as u32].map(u32::to_be_bytes).concat());
    }
    profile.extend(table);
    let length = profile.len() as u32;
    profile[..4].copy_from_slice(&length.to_be_bytes());
    let file = folder("inks").join("black.icc");
    std::fs::write(&file, profile).unwrap();
    file
}

#[test]
fn inks_are_what_the_profile_says_of_known_patches() {
    // Fails if channels are exchanged, inks are inverted, white paper gets ink, or lightness is not that of sRGB (CIE L* of IEC 61966-2-1).
    let file = black_ink();
    let inks = Inks::read(&file).unwrap();
    let greys = [0_u8, 64, 128, 200, 255];
    let rgb: Vec<u8> = greys.iter().flat_map(|g| [*g; 3]).collect();
    let deep: Vec<u16> = rgb.iter().map(|byte| u16::from(*byte) * 257).collect();
    let (bytes, words) = (inks.bytes(&rgb).unwrap(), inks.words(&deep).unwrap());
    for (n, grey) in greys.into_iter().enumerate() {
        let y = f64::from(Color([f32::from(grey) / 255.0; 3]).linear().x);
        let lightness = if y > 0.008856 { 116.0 * y.cbrt() - 16.0 } else { 903.3 * y };
        let black = 1.0 - lightness / 100.0;
        let found = [0, 1, 2, 3].map(|c| f64::from(bytes[4 * n + c]) / 255.0);
        let deep = [0, 1, 2, 3].map(|c| f64::from(words[4 * n + c]) / 65535.0);
        for found in [found, deep] {
            assert!(
                found[..3].iter().all(|ink| *ink < 0.002) && (found[3] - black).abs() < 0.008,
                "grey {grey}: {found:?}, {black} wanted"
            );
        }
    }
}

#[test]
fn a_picture_in_inks_carries_their_profile() {
    // Fails if the file is RGB, or its profile is another one.
    let icc = black_ink();
    let canvas = Canvas::filled([6, 5], Some(300.0), Some(Color([0.5; 3])));
    let file = folder("inks").join("inks.tif");
    for is_deep in [false, true] {
        write(&file, &canvas, &Encoding { is_deep, icc: Some(icc.clone()) }, None).unwrap();
        let bytes = std::fs::read(&file).unwrap();
        let mut decoder = tiff::decoder::Decoder::new(Cursor::new(&bytes[..])).unwrap();
        assert_eq!(decoder.colortype().unwrap(), tiff::ColorType::CMYK(if is_deep { 16 } else { 8 }));
        assert_eq!(decoder.get_tag_u8_vec(Tag::IccProfile).unwrap(), std::fs::read(&icc).unwrap());
        let black = match decoder.read_image().unwrap() {
            DecodingResult::U8(inks) => f64::from(inks[3]) / 255.0,
            DecodingResult::U16(inks) => f64::from(inks[3]) / 65535.0,
            _ => f64::NAN,
        };
        // sRGB's middle grey has L* = 53.4.
        assert!((black - 0.466).abs() < 0.008, "{black}");
    }
    for (name, bytes) in [("none.icc", &b"no profile"[..]), ("rgb.icc", &moxcms::ColorProfile::new_srgb().encode().unwrap()[..])] {
        let file = folder("inks").join(name);
        std::fs::write(&file, bytes).unwrap();
        assert!(Inks::read(&file).err().unwrap().to_string().contains(name));
    }
    assert_eq!(Form::of(&file).unwrap(), Form::Tiff);
}
