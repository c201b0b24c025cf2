//! Arrows point down: rooms of the library use those below them only, as `ARCHITECTURE.md` lists them.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../..")
}

/// A room: the modules it is made of, and the rooms it may use.
struct Room {
    name: String,
    modules: BTreeSet<String>,
    uses: BTreeSet<String>,
}

/// Rooms between this heading and `<!-- end -->` from the top floor down: `name (module module) -> room
/// room`, where long lines go on indented.
fn rooms(heading: &str) -> Vec<Room> {
    let page = std::fs::read_to_string(root().join("ARCHITECTURE.md")).unwrap();
    let list = page.split(heading).nth(1).unwrap().split("<!-- end -->").next().unwrap();
    let list = list.replace("\n    ", " ");
    let lines = list.lines().filter(|line| line.contains("->"));
    lines.map(|line| room(line.trim())).collect()
}

fn room(line: &str) -> Room {
    let words = |text: &str| text.split_whitespace().map(str::to_owned).collect::<BTreeSet<_>>();
    let (head, uses) = line.split_once("->").unwrap();
    let (name, modules) = head.split_once('(').map_or((head, None), |(name, modules)| (name, Some(modules)));
    let name = name.trim().to_owned();
    let modules =
        modules.map_or_else(|| words(&name), |modules| words(modules.trim_end().trim_end_matches(')')));
    Room { modules, uses: words(uses), name }
}

/// Rust files below a folder that are no tests.
fn sources(folder: &Path, files: &mut Vec<PathBuf>) {
    for entry in folder.read_dir().unwrap() {
        let path = entry.unwrap().path();
        let stem = path.file_stem().unwrap().to_str().unwrap();
        if stem == "tests" || stem.ends_with("_tests") || stem == "test_support" || stem == "tests-data" {
            continue;
        }
        if path.is_dir() {
            sources(&path, files);
        } else if path.extension().is_some_and(|extension| extension == "rs") {
            files.push(path);
        }
    }
}

/// The text of a file without its comments and its tests.
fn product(path: &Path) -> String {
    let text = std::fs::read_to_string(path).unwrap();
    let text = text.split("#[cfg(test)]\nmod tests {").next().unwrap();
    text.lines().filter(|line| !line.trim_start().starts_with("//")).collect::<Vec<_>>().join("\n")
}

/// Modules that a text names by `crate::`, in lists of imports too.
fn named(text: &str) -> BTreeSet<String> {
    let identifier =
        |text: &str| text.chars().take_while(|c| c.is_alphanumeric() || *c == '_').collect::<String>();
    let mut modules = BTreeSet::new();
    for after in text.split("crate::").skip(1) {
        let Some(list) = after.strip_prefix('{') else {
            modules.insert(identifier(after));
            continue;
        };
        let mut depth = 0;
        let mut begins = true;
        for (i, c) in list.char_indices() {
            match c {
                '{' => depth += 1,
                '}' if depth == 0 => break,
                '}' => depth -= 1,
                ',' if depth == 0 => begins = true,
                c if begins && !c.is_whitespace() => {
                    modules.insert(identifier(&list[i..]));
                    begins = false;
                }
                _ => {}
            }
        }
    }
    modules
}

/// The module of the library that a file belongs to.
fn module(file: &Path, source: &Path) -> String {
    let first = file.strip_prefix(source).unwrap().components().next().unwrap();
    let name = first.as_os_str().to_str().unwrap();
    name.strip_suffix(".rs").unwrap_or(name).to_owned()
}

/// Modules by the modules that they name, with a file that does.
fn arrows(source: &Path) -> BTreeMap<(String, String), PathBuf> {
    let mut files = vec![];
    sources(source, &mut files);
    let mut arrows = BTreeMap::new();
    for file in files.iter().filter(|file| !file.ends_with("src/lib.rs")) {
        let from = module(file, source);
        for to in named(&product(file)).into_iter().filter(|to| *to != from) {
            arrows.entry((from.clone(), to)).or_insert_with(|| file.clone());
        }
    }
    arrows
}

#[test]
fn rooms_use_those_below_them_only() {
    assert_rooms("core", &rooms("<!-- rooms -->"));
    assert_rooms("lab", &rooms("<!-- rooms of lab -->"));
}

fn assert_rooms(name: &str, rooms: &[Room]) {
    let floor = |name: &str| rooms.iter().position(|room| room.name == name);
    for (i, room) in rooms.iter().enumerate() {
        for used in &room.uses {
            let below = floor(used).unwrap_or_else(|| panic!("{}: no room `{used}`", room.name));
            assert!(
                below > i,
                "{} stands above {used} in ARCHITECTURE.md and cannot be used by it",
                room.name
            );
        }
    }
    let room_of = |module: &str| rooms.iter().find(|room| room.modules.contains(module));
    let mut unused: BTreeSet<(String, String)> = rooms
        .iter()
        .flat_map(|room| room.uses.iter().map(|used| (room.name.clone(), used.clone())))
        .collect();
    let mut wrong = vec![];
    for ((from, to), file) in arrows(&root().join("crates").join(name).join("src")) {
        let from_room =
            room_of(&from).unwrap_or_else(|| panic!("{}: `{from}` is in no room", file.display()));
        // Names of macros and of the root are no modules.
        let Some(to_room) = room_of(&to) else { continue };
        unused.remove(&(from_room.name.clone(), to_room.name.clone()));
        if from_room.name != to_room.name && !from_room.uses.contains(&to_room.name) {
            wrong.push(format!("{} uses `{to}`: {} -> {}", file.display(), from_room.name, to_room.name));
        }
    }
    assert!(wrong.is_empty(), "arrows that ARCHITECTURE.md does not list:\n{}", wrong.join("\n"));
    assert!(unused.is_empty(), "arrows of ARCHITECTURE.md that nothing needs: {unused:?}");
}

/// Crates of this workspace that a manifest names. Tests of the engine alone may stand on shapes of the mesh
/// crate.
fn crates_named(manifest: &Path) -> BTreeSet<String> {
    let text = std::fs::read_to_string(manifest).unwrap();
    let table: toml::Table = text.parse().unwrap();
    let names = table["dependencies"].as_table().unwrap().keys();
    names
        .filter_map(|name| (name == "pliant").then_some("core").or(name.strip_prefix("pliant-")))
        .map(str::to_owned)
        .collect()
}

#[test]
fn crates_use_those_below_them_only() {
    let page = std::fs::read_to_string(root().join("ARCHITECTURE.md")).unwrap();
    let list = page.split("<!-- crates -->").nth(1).unwrap().split("<!-- end of crates -->").next().unwrap();
    let listed: Vec<Room> = list.lines().filter(|line| line.contains("->")).map(room).collect();
    for (i, of) in listed.iter().enumerate() {
        let below: BTreeSet<String> = listed[i + 1..].iter().map(|of| of.name.clone()).collect();
        assert!(of.uses.is_subset(&below), "{} stands above what it uses in ARCHITECTURE.md", of.name);
        let named = crates_named(&root().join("crates").join(&of.name).join("Cargo.toml"));
        assert_eq!(named, of.uses, "crates that {} names, and those that ARCHITECTURE.md lists", of.name);
    }
    let folders = root().join("crates").read_dir().unwrap();
    assert_eq!(folders.count(), listed.len(), "crates, and those that ARCHITECTURE.md lists");
}

#[test]
fn imports_are_found_wherever_they_stand() {
    let text = "use crate::mesh::Mesh;\nuse crate::{\n    scene::{Body, Pin}, solver, \
                record::Frame,\n};\nlet x = crate::run::run();";
    let found: Vec<String> = named(text).into_iter().collect();
    assert_eq!(found, ["mesh", "record", "run", "scene", "solver"]);
}

/// Names of types that a text defines: after `struct`, `enum`, `trait` or `union` at the head of a line.
fn types_defined(text: &str) -> Vec<String> {
    let mut found = vec![];
    for line in text.lines() {
        let line = line.trim_start();
        let item = match line.strip_prefix("pub") {
            Some(rest) if rest.starts_with('(') => rest.split_once(')').map_or("", |(_, item)| item),
            Some(rest) if rest.starts_with(' ') => rest,
            _ => line,
        };
        let item = item.trim_start();
        let item = item.strip_prefix("unsafe ").unwrap_or(item);
        let Some((keyword, rest)) = item.split_once(' ') else { continue };
        if !["struct", "enum", "trait", "union"].contains(&keyword) {
            continue;
        }
        let name: String = rest.chars().take_while(|c| c.is_alphanumeric() || *c == '_').collect();
        if name.starts_with(|c: char| c.is_uppercase()) {
            found.push(name);
        }
    }
    found
}

/// Types that the sources of a folder define, with the files.
fn types(folder: &Path) -> BTreeMap<String, Vec<PathBuf>> {
    let mut files = vec![];
    sources(folder, &mut files);
    files.sort();
    let mut types: BTreeMap<String, Vec<PathBuf>> = BTreeMap::new();
    for file in files {
        for name in types_defined(&product(&file)) {
            types.entry(name).or_default().push(file.strip_prefix(root()).unwrap().to_owned());
        }
    }
    types
}

#[test]
fn type_names_are_unique_in_the_workspace() {
    let mut all: BTreeMap<String, Vec<PathBuf>> = BTreeMap::new();
    for entry in root().join("crates").read_dir().unwrap() {
        for (name, files) in types(&entry.unwrap().path().join("src")) {
            all.entry(name).or_default().extend(files);
        }
    }
    assert!(all.len() > 500, "only {} types are found", all.len());
    let twice = all.iter().filter(|(_, files)| files.len() > 1);
    let twice: Vec<String> = twice.map(|(name, files)| format!("{name}: {files:?}")).collect();
    assert!(twice.is_empty(), "types of one name:\n{}", twice.join("\n"));
}

#[test]
fn types_are_found_by_their_keywords() {
    let text = "pub(super) struct Patch<'a>(&'a f64);\n    enum Layout {\n        Struct,\n    }\npub trait \
                Term: Send {}\npub unsafe trait Lane {}\nunion Bits {}\nlet structure = \
                enumerate(trait_of);\n\
                struct $name;";
    assert_eq!(types_defined(text), ["Patch", "Layout", "Term", "Lane", "Bits"]);
}

/// Methods of a trait: doors are narrow.
const MOST_METHODS: usize = 12;

/// Traits that a formatted text defines, each with the number of its methods.
fn traits_defined(text: &str) -> Vec<(String, usize)> {
    let mut found = vec![];
    // Indentation, name and methods of the one that is being read.
    let mut open: Option<(usize, String, usize)> = None;
    for line in text.lines() {
        let item = line.trim_start();
        let indent = line.len() - item.len();
        open = match open {
            Some((own, name, methods)) if indent == own && item.starts_with('}') => {
                found.push((name, methods));
                None
            }
            Some((own, name, methods)) => {
                let is_method =
                    indent == own + 4 && ["fn ", "unsafe fn "].iter().any(|f| item.starts_with(f));
                Some((own, name, methods + usize::from(is_method)))
            }
            None => {
                let words: Vec<&str> = item.split([' ', ':', '<']).collect();
                let starts = ["pub", "pub(crate)", "pub(super)", "unsafe", "trait"];
                let at = words.iter().position(|word| *word == "trait");
                let name = at.filter(|at| words[..*at].iter().all(|word| starts.contains(word)));
                let is_open = !item.ends_with("{}");
                name.filter(|_| is_open).and_then(|at| Some((indent, (*words.get(at + 1)?).to_owned(), 0)))
            }
        };
    }
    found
}

#[test]
fn traits_have_few_methods() {
    let mut files = vec![];
    sources(&root().join("crates"), &mut files);
    let all: Vec<(String, usize)> = files.iter().flat_map(|file| traits_defined(&product(file))).collect();
    assert!(all.len() > 50, "only {} traits are found", all.len());
    let wide: Vec<_> = all.iter().filter(|(_, methods)| *methods > MOST_METHODS).collect();
    assert!(wide.is_empty(), "more than {MOST_METHODS} methods: {wide:?}");
}

#[test]
fn methods_of_traits_are_counted() {
    let text = "pub trait Wide<T>:\n    Send\n{\n    fn a();\n    /// b\n    fn b() {\n        fn inner() \
                {}\n    }\n}\n\
                mod m {\n    pub(crate) trait Narrow {\n        unsafe fn c();\n    }\n}\nfn trait_of() {}\n";
    assert_eq!(traits_defined(text), [("Wide".to_owned(), 2), ("Narrow".to_owned(), 1)]);
}

/// Comments of a file outside of blocks of code, without what stands in backticks, brackets and parentheses.
fn prose(text: &str) -> String {
    let (mut out, mut code, mut quoted, mut depth) = (String::new(), false, false, 0u32);
    for line in text.lines() {
        let Some(comment) = line.trim_start().strip_prefix("//") else {
            (code, quoted, depth) = (false, false, 0);
            continue;
        };
        let comment = comment.trim_start_matches(['/', '!']);
        if comment.trim_start().starts_with("```") {
            code = !code;
            continue;
        }
        for c in comment.chars().filter(|_| !code).chain([' ']) {
            match c {
                '`' => quoted = !quoted,
                '[' | '(' => depth += 1,
                ']' | ')' => depth = depth.saturating_sub(1),
                c if !quoted && depth == 0 => out.push(c),
                _ => {}
            }
        }
    }
    out
}

// A renaming of types that goes through comments turns words into names.
#[test]
fn comments_name_types_in_backticks_only() {
    let hump = |name: &str| name.chars().skip(1).any(char::is_uppercase) && name.contains(char::is_lowercase);
    let (mut names, mut files) = (BTreeSet::new(), vec![]);
    for entry in root().join("crates").read_dir().unwrap() {
        let crate_folder = entry.unwrap().path();
        names.extend(types(&crate_folder.join("src")).into_keys().filter(|name| hump(name)));
        // Comments of the Python package are in the format of numpydoc.
        if !crate_folder.ends_with("py") {
            sources(&crate_folder.join("src"), &mut files);
        }
    }
    assert!(names.len() > 300 && files.len() > 300, "{} names, {} files", names.len(), files.len());
    let mut bare = vec![];
    for file in &files {
        let prose = prose(&std::fs::read_to_string(file).unwrap());
        let words = prose.split(|c: char| !c.is_alphanumeric() && c != ':' && c != '_');
        bare.extend(words.filter(|word| names.contains(*word)).map(|word| format!("{word}: {file:?}")));
    }
    assert!(bare.is_empty(), "types in prose:\n{}", bare.join("\n"));
    assert_eq!(prose("/// Rest of `A` [B](c).\n/// ```\n/// D\n/// ```\nfn e()").trim(), "Rest of  .");
    assert_eq!(prose("/// Unclosed (a.\n\n/// B").trim(), "Unclosed  B");
}

#[test]
fn commands_that_benchmark_name_the_crate_whose_benches_they_are() {
    let mut files = vec![];
    sources(&root().join("crates"), &mut files);
    files.push(root().join("CONTRIBUTING.md"));
    let mut commands = 0;
    for file in files {
        let text = std::fs::read_to_string(&file).unwrap().replace("//!", "").replace("///", "");
        let words: Vec<&str> = text.split([' ', '\n', '`', ')']).filter(|word| !word.is_empty()).collect();
        for command in words.windows(6).filter(|w| w[..3] == ["cargo", "bench", "-p"] && w[4] == "--bench") {
            let folder = match command[3] {
                "pliant" => "core",
                name => name.strip_prefix("pliant-").unwrap_or(name),
            };
            let bench = root().join(format!("crates/{folder}/benches/{}.rs", command[5]));
            assert!(bench.is_file(), "{file:?}: {command:?}");
            commands += 1;
        }
    }
    assert!(commands >= 5, "{commands}");
}

/// Files and functions of the tests that the rows of a table name in their last two cells.
fn tests_named(page: &str) -> Vec<(String, String)> {
    let rows = page.lines().filter(|line| line.starts_with("| ") && line.ends_with("` |"));
    let of_row = |row: &str| {
        let mut cells =
            row.trim_matches('|').rsplit('|').map(|cell| cell.trim().trim_matches('`').to_owned());
        let name = cells.next()?;
        Some((cells.next()?, name))
    };
    rows.filter_map(of_row).collect()
}

#[test]
fn every_promise_names_a_test_that_exists() {
    let page = std::fs::read_to_string(root().join("tests/PROMISES.md")).unwrap();
    let tests = tests_named(&page);
    assert!(tests.len() > 40, "only {} promises are found", tests.len());
    let mut missing = vec![];
    for (file, name) in &tests {
        let text = std::fs::read_to_string(root().join(file)).unwrap_or_default();
        // Functions of Rust and of Python.
        let exists = ["fn", "def"].iter().any(|keyword| text.contains(&format!("{keyword} {name}(")));
        if !exists {
            missing.push(format!("{name} in {file}"));
        }
    }
    assert!(missing.is_empty(), "tests of PROMISES.md that do not exist:\n{}", missing.join("\n"));
    let row = "| a promise | of `b` | `tests/c.rs` | `d` |\n|---|---|---|---|\n";
    assert_eq!(tests_named(row), [("tests/c.rs".to_owned(), "d".to_owned())]);
}
