//! Steps that are too large.

use super::{Bench, SPRING};

#[test]
fn a_step_above_the_limit_is_refused_with_one_that_would_do() {
    let bench = Bench::new(&SPRING.replace("step = 0.002", "step = 0.15"));
    let ended = bench.pliant(["scene.toml"]).ended_with(2).says(&[
        "scene.toml:5:8",
        "allows at most 141 ms",
        "allow_unstable",
    ]);
    assert!(bench.files().is_empty());
    // The number in the advice is taken at its word.
    let step = ended.stderr.split("use `step = ").nth(1).unwrap().split('`').next().unwrap();
    assert_eq!(step.parse::<f64>().unwrap(), 0.13);
    bench.pliant(["scene.toml", "--set", &format!("time.step={step}")]).succeeded();
}

#[test]
fn check_shows_the_problem_and_then_the_error() {
    let bench = Bench::new(&SPRING.replace("step = 0.002", "step = 0.15"));
    bench
        .pliant(["check", "scene.toml"])
        .ended_with(2)
        .prints(&["2 vertices", "UNSTABLE"])
        .says(&["scene.toml:5:8"]);
    let json = bench.pliant(["check", "scene.toml", "--json"]).ended_with(2).json();
    assert_eq!((json["status"].as_str(), json["problems"][0]["line"].as_u64()), (Some("invalid"), Some(5)));
    let limit = json["report"]["stability"]["step"].as_f64().unwrap();
    assert!((limit - 2.0 / 200f64.sqrt()).abs() < 1e-9, "{limit}");
}

#[test]
fn a_run_that_is_allowed_to_blow_up_ends_by_itself() {
    let text = SPRING.replace("step = 0.002", "step = 0.15\nallow_unstable = true");
    let bench = Bench::new(&text.replace("duration = 1.0", "duration = 1e6"));
    let ended = bench.pliant(["scene.toml"]).ended_with(1);
    ended.says(&["error: unstable: after step", "use at most 140 ms", "scene.mcap is complete up to t = "]);
    let info = bench.info("scene.mcap");
    assert_eq!(
        (info["state"].as_str(), info["outcome"]["status"].as_str()),
        (Some("complete"), Some("failed"))
    );
    let (steps, end) = (info["outcome"]["step"].as_u64().unwrap(), info["end_time"].as_f64().unwrap());
    // The state that blew up is no frame.
    assert!(steps < 10_000 && (end - (steps - 1) as f64 * 0.15).abs() < 1e-6, "{info}");
    let json = bench.pliant(["scene.toml", "--force", "--json"]).ended_with(1).json();
    assert_eq!(
        (json["status"].as_str(), json["problems"][0]["kind"].as_str()),
        (Some("failed"), Some("unstable"))
    );
}
