//! The table of hard cases tells the truth: every test it names is there.

use std::path::Path;

/// The cells in back quotes: file and function.
fn named_tests(row: &str) -> Option<(&str, &str)> {
    let cell = row.trim_end().strip_suffix('|')?.rsplit('|').next()?;
    let mut quoted = cell.split('`').skip(1).step_by(2);
    Some((quoted.next()?, quoted.next()?))
}

#[test]
fn every_hard_case_names_a_test_that_exists() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
    let table = std::fs::read_to_string(root.join("docs/hard-cases.md")).unwrap();
    let rows: Vec<&str> = table.lines().filter(|l| l.starts_with('|')).skip(2).collect();
    assert!(rows.len() >= 30, "{} hard cases", rows.len());
    for row in rows {
        let (file, function) = named_tests(row).unwrap_or_else(|| panic!("no test is named in: {row}"));
        let source = std::fs::read_to_string(root.join(file)).unwrap_or_else(|e| panic!("{file}: {e}"));
        // A test of a macro such as proptest! is a function like any other, under an attribute of its own.
        let at = source.find(&format!("fn {function}(")).unwrap_or_else(|| panic!("{file} has no `{function}`"));
        assert!(source[..at].rfind("#[test]").is_some(), "{file}: `{function}` is no test");
    }
}
