//! Sounds against sums of exponentials.

use std::f64::consts::{PI, TAU};

use super::strand;
use pliant::modes::{SoundError, Strike};

fn blow(vertex: usize) -> Strike {
    Strike { vertex, direction: vec![3.0, 0.0], listen: None, rayleigh: Some((0.4, 1e-3)) }
}

/// Fourteen masses: amplitudes are squares of sines, decays (alpha + beta omega^2)/2; sampled exactly but
/// for rounding.
#[test]
fn a_struck_chain_sounds_as_its_modes() {
    let mut chain = strand();
    let rate = 100.0;
    let sound = chain.sound(14, &blow(2), rate).unwrap();
    assert_eq!(sound.partials.len() + sound.silent.not_struck, 14);
    // 2 sqrt(1000) / 2 pi is 10 Hz at most.
    assert_eq!(sound.silent.above_nyquist, 0);
    let tones: Vec<(f64, f64, f64)> = (1..=14)
        .map(|j| {
            let angle = f64::from(j) * PI / 30.0;
            let omega = 2.0 * (1000.0f64).sqrt() * angle.sin();
            let amplitude = 2.0 / (15.0 * 0.1) * (2.0 * angle * 2.0).sin().powi(2);
            (omega, 0.5 * (0.4 + 1e-3 * omega * omega), amplitude)
        })
        .filter(|tone| tone.2 > 1e-9)
        .collect();
    for (partial, (omega, decay, amplitude)) in sound.partials.iter().zip(&tones) {
        let damped = (omega * omega - decay * decay).sqrt() / TAU;
        assert!((partial.frequency / damped - 1.0).abs() < 1e-9, "{partial:?}: {damped} Hz");
        assert!((partial.decay / decay - 1.0).abs() < 1e-8, "{partial:?}: {decay}");
        assert!((partial.amplitude / amplitude - 1.0).abs() < 1e-6, "{partial:?}: {amplitude}");
    }
    let samples = sound.samples(20.0, 0.5);
    assert_eq!(samples.len(), 2000);
    let value = |n: usize| {
        let t = n as f64 / rate;
        let tone = |(omega, decay, amplitude): &(f64, f64, f64)| {
            amplitude * (-decay * t).exp() * ((omega * omega - decay * decay).sqrt() * t).sin()
        };
        tones.iter().map(tone).sum::<f64>()
    };
    let exact: Vec<f64> = (0..2000).map(value).collect();
    let largest = exact.iter().fold(0.0f64, |m, s| m.max(s.abs()));
    for (sample, exact) in samples.iter().zip(&exact) {
        assert!((sample - 0.5 * exact / largest).abs() < 1e-6, "{sample}");
    }
    assert!((samples.iter().fold(0.0f64, |m, s| m.max(s.abs())) - 0.5).abs() < 1e-15);
}

#[test]
fn what_is_not_heard_is_counted() {
    let mut chain = strand();
    // Half the sample rate in the middle of the band: w_j / 2 pi >= 5 Hz for sin(j pi / 30) >= 0.4967, j >=
    // 5.
    let sound = chain.sound(14, &blow(2), 10.0).unwrap();
    assert_eq!(sound.silent.above_nyquist, 10);
    // With (alpha + beta w^2)/2 > w from w = 2/beta on.
    let strong = Strike { rayleigh: Some((0.0, 0.04)), ..blow(2) };
    let overdamped =
        (1..=14).filter(|j| 2.0 * 1000f64.sqrt() * (f64::from(*j) * PI / 30.0).sin() > 50.0).count();
    assert_eq!(chain.sound(14, &strong, 1e3).unwrap().silent.overdamped, overdamped);
    assert!(matches!(chain.sound(14, &blow(16), 1e3), Err(SoundError::NoVertex { vertex: 16, count: 16 })));
    assert!(matches!(chain.sound(14, &blow(0), 1e3), Err(SoundError::Held { vertex: 0, .. })));
    let sideways = Strike { direction: vec![0.0, 1.0], ..blow(3) };
    assert!(matches!(chain.sound(14, &sideways, 1e3), Err(SoundError::Held { vertex: 3, .. })));
    for direction in [vec![0.0, 0.0], vec![1.0], vec![f64::NAN, 1.0]] {
        let none = Strike { direction, ..blow(2) };
        assert!(matches!(chain.sound(14, &none, 1e3), Err(SoundError::Direction { .. })));
    }
    assert!(matches!(chain.sound(14, &blow(2), 1e-3), Err(SoundError::Silence { modes: 14, .. })));
}
