use super::*;
use bregma_field::{AnyBlock, Store, Volume};
use bregma_synthetic::Which;
use glam::DAffine3;
use std::sync::Arc;

/// The demo's skull, and for each sample whether it is bone of it.
fn phantom() -> (Volume, Vec<i16>) {
    let volume = bregma_synthetic::skull(Which::A, 128, &Progress::default()).unwrap();
    let AnyBlock::I16(block) = Store::of(&volume).whole() else { panic!("the phantom is of 16 bits") };
    let samples = block.onward([0; 3]).to_vec();
    (volume, samples)
}

const ISO: f64 = 226.0;

fn kept(volume: Volume) -> WholeSkull {
    keep_the_skull(&Surface::new(&Arc::new(volume), ISO, DAffine3::IDENTITY).unwrap(), &Progress::default()).unwrap()
}

fn count(labels: &Labels) -> u64 {
    labels.statistics(&labels.volume())[0].samples
}

#[test]
fn a_skull_alone_is_kept_whole_and_a_table_that_holds_it_is_not() {
    // Fails if a jaw is taken for what does not belong to a skull, bone is lost with the table, or more than a few samples of the table stay.
    let (volume, samples) = phantom();
    let bone = samples.iter().filter(|&&s| f64::from(s) >= ISO).count() as u64;
    let alone = kept(volume.clone());
    assert_eq!((alone.radius_mm, alone.left_out), (0.0, 0));
    assert!(count(&alone.labels) as f64 > 0.999 * bone as f64, "{} of {bone}", count(&alone.labels));

    let [nx, ny, _] = volume.grid().dims();
    let mut on_a_table = samples.clone();
    let mut table = 0_u64;
    for (n, sample) in on_a_table.iter_mut().enumerate() {
        let [i, j, k] = [n % nx, n / nx % ny, n / (nx * ny)];
        // Behind the head, three samples thick; a post of two by two samples holds it.
        let is_table = j + 3 >= ny || (nx / 2..nx / 2 + 2).contains(&i) && (78..80).contains(&k) && j + 10 >= ny;
        if is_table && f64::from(*sample) < ISO {
            *sample = 1200;
            table += 1;
        }
    }
    let held = kept(volume.with_samples(Samples::I16(on_a_table)).unwrap());
    println!("a table of {table} samples: {} left out where a ball of {} mm passes", held.left_out, held.radius_mm);
    assert!(held.radius_mm > 0.0 && held.left_out <= table, "{} of {table} at {}", held.left_out, held.radius_mm);
    assert!(held.left_out as f64 > 0.99 * table as f64, "{} of {table}", held.left_out);
    let lost = samples.iter().enumerate().filter(|(n, s)| {
        let at = [n % nx, n / nx % ny, n / (nx * ny)];
        f64::from(**s) >= ISO && alone.labels.number(at) == 1 && held.labels.number(at) == 0
    });
    assert_eq!(lost.count(), 0);
}

#[test]
fn a_plate_larger_than_the_skull_is_none() {
    // Fails if the largest island is taken whatever its shape.
    let (volume, mut samples) = phantom();
    let [nx, ny, nz] = volume.grid().dims();
    let skull = samples.iter().filter(|&&s| f64::from(s) >= ISO).count();
    // Ahead of the face, as thick as it takes.
    let thick = skull * 12 / 10 / (nx * nz) + 1;
    let grown = [nx, ny + thick + 2, nz];
    let air = *samples.iter().min().unwrap();
    let row = |n: usize| n / nx;
    let mut with_plate = vec![air; grown.iter().product()];
    for (n, sample) in samples.drain(..).enumerate() {
        let (j, k) = (row(n) % ny, row(n) / ny);
        with_plate[n % nx + nx * (j + thick + 2 + grown[1] * k)] = sample;
    }
    for (n, sample) in with_plate.iter_mut().enumerate() {
        if row(n) % grown[1] < thick {
            *sample = 1200;
        }
    }
    let grid = Grid::new(grown, volume.grid().spacing_mm(), DVec3::ZERO, DMat3::IDENTITY).unwrap();
    let raster =
        bregma_field::Raster { grid, samples: Samples::I16(with_plate), slope: 1.0, intercept: 0.0, unit: volume.unit(), warnings: vec![] };
    let found = kept(Volume::new("plate".into(), "test", raster).unwrap());
    let islands_of_skull = count(&found.labels);
    assert!(islands_of_skull as f64 > 0.99 * skull as f64 && islands_of_skull <= skull as u64, "{islands_of_skull} of {skull}");
}
