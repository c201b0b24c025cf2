//! `pliant live`.

use std::net::IpAddr;
use std::path::PathBuf;

use clap::Args;

/// `pliant live`.
#[derive(Args, Clone, Debug)]
pub(crate) struct LiveArguments {
    /// Scene file (TOML)
    pub(crate) scene: PathBuf,
    /// Change a value of the scene, for example time.step=1e-3; repeatable
    #[arg(long, value_name = "PATH=VALUE")]
    pub(crate) set: Vec<String>,
    /// Address to listen on, instead of this machine's loopback
    #[arg(long, value_name = "ADDRESS", default_value = "127.0.0.1", hide_default_value = true)]
    pub(crate) bind: IpAddr,
    /// Port to listen on; by default a random one
    #[arg(long, default_value_t = 0, hide_default_value = true)]
    pub(crate) port: u16,
    /// Print the address without opening it
    #[arg(long)]
    pub(crate) no_open: bool,
    /// Simulated seconds per second, or `max`
    #[arg(long, default_value = "1", value_parser = speed)]
    pub(crate) speed: Speed,
    /// Start paused
    #[arg(long)]
    pub(crate) paused: bool,
    /// Record from the start, to a file below the working folder
    #[arg(long, value_name = "FILE")]
    pub(crate) record: Option<PathBuf>,
}

/// Simulated seconds a second; `None` as fast as it goes.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Speed(pub(crate) Option<f64>);

fn speed(text: &str) -> Result<Speed, String> {
    match text.parse::<f64>() {
        _ if text == "max" => Ok(Speed(None)),
        Ok(speed) if speed.is_finite() && speed > 0.0 => Ok(Speed(Some(speed))),
        _ => Err("it must be a positive number, like 0.5, or `max`".into()),
    }
}
