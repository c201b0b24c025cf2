//! Notes what the program is built from, for the tables of studies.

use std::path::PathBuf;
use std::process::Command;

fn main() {
    let rustc = std::env::var("RUSTC").unwrap_or_else(|_| "rustc".into());
    let version = output(&rustc, &["--version"]).unwrap_or_else(|| "unknown compiler".into());
    println!("cargo::rustc-env=PLIANT_RUSTC={version}");
    let commit = packaged().or_else(|| git(&["rev-parse", "--short=12", "HEAD"]));
    println!("cargo::rustc-env=PLIANT_COMMIT={}", commit.unwrap_or_else(|| "unknown".into()));
    // OPT_LEVEL is that of this crate, which is not that of the kernels: the profile has a level for each.
    let profile = profile().map_or_else(|| "unknown profile".into(), |name| format!("{name} profile"));
    let flags = std::env::var("CARGO_ENCODED_RUSTFLAGS").unwrap_or_default().replace('\u{1f}', " ");
    println!("cargo::rustc-env=PLIANT_FLAGS={}", format!("{profile} {flags}").trim());
    // A commit moves the log of HEAD, a checkout too.
    if let Some(log) = git(&["rev-parse", "--git-path", "logs/HEAD"]) {
        println!("cargo::rerun-if-changed={log}");
    }
    println!("cargo::rerun-if-changed=build.rs");
}

/// Output of `git`, which is asked about a checkout of another user as well: containers have those.
fn git(arguments: &[&str]) -> Option<String> {
    output("git", &[&["-c", "safe.directory=*"], arguments].concat())
}

/// The commit that cargo notes in a package.
fn packaged() -> Option<String> {
    let text = std::fs::read_to_string(".cargo_vcs_info.json").ok()?;
    Some(text.split("\"sha1\": \"").nth(1)?.get(..12)?.to_owned())
}

/// Name of the profile: `OUT_DIR` is `target/[triple/]PROFILE/build/..`.
fn profile() -> Option<String> {
    let out = PathBuf::from(std::env::var("OUT_DIR").ok()?);
    let build = out.ancestors().find(|folder| folder.file_name().is_some_and(|name| name == "build"))?;
    let name = build.parent()?.file_name()?.to_str()?;
    Some(if name == "debug" { "dev" } else { name }.to_owned())
}

fn output(program: &str, arguments: &[&str]) -> Option<String> {
    let output =
        Command::new(program).args(arguments).output().ok().filter(|output| output.status.success())?;
    Some(String::from_utf8(output.stdout).ok()?.trim().to_owned())
}
