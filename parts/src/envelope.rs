//! Lower envelopes of parabolas: along a line, from squared distances that are known across it, the least with what the line adds (Felzenszwalb and
//! Huttenlocher 2012, doi:10.4086/toc.2012.v008a019).

/// The envelope of a line, kept for the next one: where each parabola stands, its height, and from where on it is the lowest, all in samples.
#[derive(Default)]
pub(crate) struct Envelope {
    parabolas: Vec<(usize, f64, f64)>,
}

impl Envelope {
    /// Makes of squared distances, mm², infinite where none is known, the least of each with the squares of the ways along the line, whose samples lie
    /// `spacing_mm` apart.
    pub fn lower(&mut self, line: &mut [f32], spacing_mm: f64) {
        let square = spacing_mm * spacing_mm;
        self.parabolas.clear();
        for (n, height) in line.iter().enumerate().filter(|(_, height)| height.is_finite()) {
            let height = f64::from(*height) / square;
            let mut from = f64::NEG_INFINITY;
            while let Some(&(at, low, since)) = self.parabolas.last() {
                // Where both are as high.
                from = ((height - low) / (n - at) as f64 + (n + at) as f64) / 2.0;
                if from > since {
                    break;
                }
                self.parabolas.pop();
                from = f64::NEG_INFINITY;
            }
            self.parabolas.push((n, height, from));
        }
        let mut lowest = 0;
        for (n, value) in line.iter_mut().enumerate() {
            while self.parabolas.get(lowest + 1).is_some_and(|next| next.2 <= n as f64) {
                lowest += 1;
            }
            if let Some(&(at, height, _)) = self.parabolas.get(lowest) {
                *value = ((height + (n as f64 - at as f64).powi(2)) * square) as f32;
            }
        }
    }
}
