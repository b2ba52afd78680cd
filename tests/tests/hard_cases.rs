//! The table of hard cases tells the truth: every test it names is there.

use std::path::Path;

/// The last cell's back quotes: a file, then functions in it, then perhaps another file.
fn named_tests(row: &str) -> Vec<(&str, &str)> {
    let cell = row.trim_end().strip_suffix('|').and_then(|row| row.rsplit('|').next()).unwrap_or_default();
    let (mut file, mut tests) = ("", Vec::new());
    for name in cell.split('`').skip(1).step_by(2) {
        if name.ends_with(".rs") { file = name } else { tests.push((file, name)) }
    }
    tests
}

#[test]
fn every_hard_case_names_a_test_that_exists() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
    let page = std::fs::read_to_string(root.join("docs/hard-cases.md")).unwrap();
    let rows: Vec<&str> = page.lines().take_while(|l| !l.starts_with("## ")).filter(|l| l.starts_with('|')).skip(2).collect();
    assert!(rows.len() >= 30, "{} hard cases", rows.len());
    for row in rows {
        let tests = named_tests(row);
        assert!(!tests.is_empty(), "no test is named in: {row}");
        for (file, function) in tests {
            let source = std::fs::read_to_string(root.join(file)).unwrap_or_else(|e| panic!("{file}: {e}"));
            // A test of a macro such as proptest! is a function like any other, under an attribute of its own.
            let at = source.find(&format!("fn {function}(")).unwrap_or_else(|| panic!("{file} has no `{function}`"));
            // Tests that need a GPU are in a list instead.
            let listed = source.contains(&format!("::{function}\", {function})"));
            assert!(listed || source[..at].rfind("#[test]").is_some(), "{file}: `{function}` is no test");
        }
    }
}
