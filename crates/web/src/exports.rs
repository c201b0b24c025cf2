//! Functions that JavaScript calls.
//!
//! # Safety
//! A WebAssembly instance of this library has one thread, and JavaScript calls one function at a time, so
//! that nothing else has the state while a function has it.
#![allow(unsafe_code)]

use std::cell::RefCell;
use std::panic;
use std::path::Path;
use std::time::Duration;

use pliant_files::{clock, memory};
use pliant_live::{EmbeddedScene, LiveError, LiveMessage};
use pliant_scene::Source;
use serde_json::json;

/// Time that steps take in one call [ms].
const TURN: Duration = Duration::from_millis(12);
/// Directory of recordings.
const RECORDINGS: &str = "recordings";
/// Name of the scene in messages.
const SCENE: &str = "scene.toml";

#[derive(Default)]
struct Instance {
    scene: Option<EmbeddedScene>,
    /// Names of files from outside.
    files: Vec<String>,
    positions: Vec<f64>,
}

thread_local! {
    static INSTANCE: RefCell<Instance> = RefCell::default();
    static RESULT: RefCell<Vec<u8>> = const { RefCell::new(vec![]) };
}

mod imports {
    #[link(wasm_import_module = "env")]
    unsafe extern "C" {
        pub(super) safe fn now() -> f64;
    }
}

fn now() -> f64 {
    imports::now()
}

fn set_result(bytes: impl Into<Vec<u8>>) {
    RESULT.set(bytes.into());
}

fn with<T>(work: impl FnOnce(&mut Instance) -> T) -> T {
    INSTANCE.with_borrow_mut(work)
}

/// Bytes from outside.
///
/// # Safety
/// `pointer` is of [`alloc`], for `length` bytes at least, and has not been released.
unsafe fn bytes<'a>(pointer: *const u8, length: usize) -> &'a [u8] {
    // SAFETY: as promised by the caller; `alloc` has initialised them.
    unsafe { std::slice::from_raw_parts(pointer, length) }
}

/// Memory for `length` bytes.
#[unsafe(no_mangle)]
pub extern "C" fn alloc(length: usize) -> *mut u8 {
    Box::into_raw(vec![0_u8; length].into_boxed_slice()).cast()
}

/// Gives memory back.
///
/// # Safety
/// `pointer` is of [`alloc`], for `length` bytes, and is not used any more.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn release(pointer: *mut u8, length: usize) {
    // SAFETY: as promised by the caller, this is the box of `alloc`.
    drop(unsafe { Box::from_raw(std::ptr::slice_from_raw_parts_mut(pointer, length)) });
}

/// Adds a file that scenes may name; 0, or 1 and the reason.
///
/// # Safety
/// Both pointers are of [`alloc`], for these lengths.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn file(name: *const u8, name_length: usize, data: *const u8, length: usize) -> u32 {
    // SAFETY: as promised by the caller.
    let (name, data) = unsafe { (bytes(name, name_length), bytes(data, length)) };
    let name = String::from_utf8_lossy(name).into_owned();
    match memory::put(Path::new(&name), data.to_vec()) {
        Ok(()) => {
            with(|instance| instance.files.push(name));
            0
        }
        Err(error) => {
            set_result(format!("{name}: {error}"));
            1
        }
    }
}

/// Removes these files.
#[unsafe(no_mangle)]
pub extern "C" fn forget_files() {
    for name in with(|instance| std::mem::take(&mut instance.files)) {
        // One name may have been given twice.
        let _ = memory::remove_file(&name);
    }
}

/// Opens the scene of a text in place of the last one.
///
/// # Safety
/// `text` is of [`alloc`], for this length.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn open(text: *const u8, length: usize) -> u32 {
    clock::set(now);
    panic::set_hook(Box::new(|fault| set_result(fault.to_string())));
    // SAFETY: as promised by the caller.
    let text = String::from_utf8_lossy(unsafe { bytes(text, length) }).into_owned();
    with(|instance| {
        // Frees its memory and its recordings first.
        instance.scene = None;
        let _ = memory::remove_dir_all(RECORDINGS);
        match EmbeddedScene::new(Source::new(SCENE, text), Path::new(RECORDINGS)) {
            Ok(scene) => {
                set_result(scene.page());
                instance.scene = Some(scene);
                0
            }
            Err(error) => {
                set_result(described(&error));
                1
            }
        }
    })
}

/// An error as JSON: with its place, if it is one of the scene.
fn described(error: &LiveError) -> String {
    let LiveError::Scene(error) = error else {
        let message = error.to_string();
        return json!({ "message": message, "line": null, "column": null, "rendered": message }).to_string();
    };
    let message = error.problems().first().map_or_else(|| error.to_string(), |first| first.message.clone());
    let (line, column, rendered) = (error.line(), error.column(), error.render(false));
    json!({ "message": message, "line": line, "column": column, "rendered": rendered }).to_string()
}

/// A page has connected.
#[unsafe(no_mangle)]
pub extern "C" fn greet() {
    with(|instance| instance.scene.iter_mut().for_each(EmbeddedScene::connect));
}

/// Takes a message of the page.
///
/// # Safety
/// `text` is of [`alloc`], for this length.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn command(text: *const u8, length: usize) {
    // SAFETY: as promised by the caller.
    let text = String::from_utf8_lossy(unsafe { bytes(text, length) });
    with(|instance| instance.scene.iter().for_each(|scene| scene.command(&text)));
}

/// Executes commands and takes steps; milliseconds until the next call.
#[unsafe(no_mangle)]
pub extern "C" fn advance() -> f64 {
    let wait = with(|instance| instance.scene.as_mut().map(|scene| scene.advance(TURN)));
    wait.map_or(f64::INFINITY, |wait| 1e3 * wait.as_secs_f64())
}

/// Takes the next message to the page: 0 none, 1 a text, 2 a frame.
#[unsafe(no_mangle)]
pub extern "C" fn message() -> u32 {
    match with(|instance| instance.scene.as_mut().and_then(EmbeddedScene::message)) {
        None => 0,
        Some(LiveMessage::Text(text)) => {
            set_result(text);
            1
        }
        Some(LiveMessage::Frame(frame)) => {
            set_result(frame);
            2
        }
    }
}

/// Makes the MCAP file of the run so far.
#[unsafe(no_mangle)]
pub extern "C" fn download() -> u32 {
    let recorded = with(|instance| instance.scene.as_mut().map(EmbeddedScene::recorded));
    match recorded.unwrap_or(Err(LiveError::NothingRecorded)) {
        Ok(file) => {
            set_result(file);
            0
        }
        Err(error) => {
            set_result(error.to_string());
            1
        }
    }
}

/// Takes steps without a page.
#[unsafe(no_mangle)]
pub extern "C" fn run(steps: u32) -> u32 {
    let failure = with(|instance| {
        let scene = instance.scene.as_mut()?;
        let failure = scene.run(steps.into()).err();
        instance.positions = scene.simulation().positions().into_owned();
        failure
    });
    match failure {
        None => 0,
        Some(failure) => {
            set_result(failure.message);
            1
        }
    }
}

/// Positions after [`run`] [m].
#[unsafe(no_mangle)]
pub extern "C" fn positions() -> *const f64 {
    with(|instance| instance.positions.as_ptr())
}

/// Number of coordinates in them.
#[unsafe(no_mangle)]
pub extern "C" fn positions_len() -> usize {
    with(|instance| instance.positions.len())
}

/// The fused multiply-add that compilers call, in place of the slower one that the standard library brings.
#[unsafe(no_mangle)]
pub extern "C" fn fma(a: f64, b: f64, c: f64) -> f64 {
    pliant::lanes::mul_add(a, b, c)
}

/// Result of the last call.
#[unsafe(no_mangle)]
pub extern "C" fn result() -> *const u8 {
    RESULT.with_borrow(Vec::as_ptr)
}

/// Number of bytes in it.
#[unsafe(no_mangle)]
pub extern "C" fn result_len() -> usize {
    RESULT.with_borrow(Vec::len)
}
