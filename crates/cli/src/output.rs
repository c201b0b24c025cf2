//! Files of reports.

use std::path::Path;

use crate::failure::Failure;

/// Makes a folder, unless it is there.
///
/// # Errors
/// It cannot be made, or is a file.
pub(crate) fn folder(path: &Path) -> Result<(), Failure> {
    if path.is_file() {
        return Err(Failure::usage(format!("{} is a file; name a folder", path.display())));
    }
    std::fs::create_dir_all(path).map_err(|error| {
        Failure::failed("output", format!("cannot make the folder {}: {error}", path.display()))
    })
}

/// Writes a text.
///
/// # Errors
/// It cannot be written.
pub(crate) fn file(path: &Path, text: &str) -> Result<(), Failure> {
    std::fs::write(path, text)
        .map_err(|error| Failure::failed("output", format!("cannot write {}: {error}", path.display())))
}

/// A line of comma-separated values, quoted where they have to be; RFC 4180.
pub(crate) fn csv_line(values: &[&str]) -> String {
    let quoted = |value: &&str| {
        if value.contains([',', '"', '\n', '\r']) {
            format!("\"{}\"", value.replace('"', "\"\"").replace(['\n', '\r'], " "))
        } else {
            (*value).to_owned()
        }
    };
    values.iter().map(quoted).collect::<Vec<_>>().join(",") + "\n"
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_with_commas_and_quotes_are_quoted() {
        assert_eq!(csv_line(&["a", "b, c", "d\"e", "f\ng"]), "a,\"b, c\",\"d\"\"e\",\"f g\"\n");
    }
}
