//! Time of a channel-sample of the change detector in Rust, for comparison with the package:
//!
//!     cargo run --release --example channel_sample -- FILE CHANNELS WINDOW LAG INTERVAL PRIOR_SCATTER
//!
//! FILE has float64 values row by row, as `array.tofile` writes them. Prints the lower quartile over blocks of 1000 rows in
//! nanoseconds: a busy machine interrupts some of them.

use std::time::Instant;

use diagnosis::divergence::{DivergenceBank, DivergenceSettings, Interval};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [file, channels, window, lag, vectors, prior_scatter] = &arguments[..] else {
        return Err("expected FILE CHANNELS WINDOW LAG INTERVAL PRIOR_SCATTER".into());
    };
    let bytes = std::fs::read(file)?;
    let samples: Vec<f64> =
        bytes.as_chunks::<8>().0.iter().map(|b| f64::from_le_bytes(*b)).collect();
    let channels: usize = channels.parse()?;
    let interval = Interval::Sliding { vectors: vectors.parse()? };
    let settings = DivergenceSettings { window: window.parse()?, lag: lag.parse()?, interval };
    let (mut times_s, mut largest) = (Vec::new(), 0.0_f64);
    for _ in 0..10 {
        let mut bank = DivergenceBank::new(settings, &vec![prior_scatter.parse()?; channels])?;
        for block in samples.chunks_exact(1000 * channels) {
            let begin = Instant::now();
            for row in block.chunks_exact(channels) {
                let found = bank.push(row).iter().filter_map(|outcome| outcome.divergence());
                largest = found.fold(largest, f64::max);
            }
            times_s.push(begin.elapsed().as_secs_f64() / block.len() as f64);
        }
    }
    times_s.sort_unstable_by(f64::total_cmp);
    let quartile_s = times_s.get(times_s.len() / 4).ok_or("expected at least 1000 rows")?;
    #[expect(clippy::print_stdout, reason = "the result")]
    {
        println!("{} (largest divergence {largest})", 1e9 * quartile_s);
    }
    Ok(())
}
