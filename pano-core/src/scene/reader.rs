//! Typed access to spanned TOML values; every fault becomes an [`Error::Scene`] that points at the text.

use super::parse::KEYS;
use crate::{Error, Result, SceneError};
use glam::Vec3;
use std::{ops::Range, path::Path};
use toml::{
    Spanned,
    de::{DeArray, DeTable, DeValue},
};

/// The text that is read, for building errors.
#[derive(Clone, Copy)]
pub(super) struct Source<'a> {
    pub(super) path: &'a Path,
    pub(super) text: &'a str,
}

impl Source<'_> {
    /// An error about the bytes `span`.
    pub(super) fn error(&self, span: Range<usize>, problem: impl Into<String>, remedy: impl Into<String>) -> Error {
        let start = self.text.floor_char_boundary(span.start);
        let end = self.text.ceil_char_boundary(span.end.max(start));
        let before = &self.text[..start];
        let line_start = before.rfind('\n').map_or(0, |i| i + 1);
        Error::Scene(Box::new(SceneError {
            path: self.path.to_owned(),
            text: self.text.to_owned(),
            span: start..end,
            line: before.matches('\n').count() + 1,
            column: before[line_start..].chars().count() + 1,
            problem: problem.into(),
            remedy: remedy.into(),
        }))
    }
}

/// A table of the file, with its name in [`KEYS`].
pub(super) struct Table<'a> {
    source: Source<'a>,
    name: &'static str,
    span: Range<usize>,
    table: &'a DeTable<'a>,
}

impl<'a> Table<'a> {
    /// The document itself.
    pub(super) fn root(source: Source<'a>, table: &'a DeTable<'a>) -> Result<Self> {
        Self { source, name: "", span: 0..0, table }.checked()
    }

    /// Fails on the first key in the text that the table does not have.
    fn checked(self) -> Result<Self> {
        let known = KEYS.iter().find(|(name, _)| *name == self.name).map_or(&[][..], |(_, keys)| keys);
        let unknown = self.table.keys().filter(|k| !known.contains(&&**k.get_ref())).min_by_key(|k| k.span().start);
        let Some(key) = unknown else { return Ok(self) };
        let (name, place) = (&**key.get_ref(), describe(self.name));
        let home = KEYS.iter().find(|(table, keys)| *table != self.name && keys.contains(&name));
        let remedy = match (near_miss(name, known), home) {
            (Some(near), _) => format!("did you mean `{near}`?"),
            (None, Some((table, _))) => format!("`{name}` belongs in {}", describe(table)),
            (None, None) => format!("keys here are: {}", known.join(", ")),
        };
        Err(self.source.error(key.span(), format!("unknown key `{name}` in {place}"), remedy))
    }

    /// The value of `key`, if it is there.
    pub(super) fn get(&self, key: &'static str) -> Option<Value<'a>> {
        debug_assert!(KEYS.iter().any(|(name, keys)| *name == self.name && keys.contains(&key)), "{} {key}", self.name);
        Some(Value { source: self.source, key, value: self.table.get(key)?, element_of: None })
    }

    /// The value of `key`; an error at the table if it is missing.
    pub(super) fn require(&self, key: &'static str, remedy: &str) -> Result<Value<'a>> {
        self.get(key).ok_or_else(|| self.error(format!("{} has no `{key}`", describe(self.name)), remedy))
    }

    /// Fails at the later one if both keys are there.
    pub(super) fn exclusive(&self, a: &'static str, b: &'static str, remedy: &str) -> Result<()> {
        let span = |key| self.table.get_key_value(key).map(|(k, _)| k.span());
        let (Some(first), Some(second)) = (span(a), span(b)) else { return Ok(()) };
        let later = if first.start > second.start { first } else { second };
        Err(self.source.error(later, format!("`{a}` and `{b}` exclude each other"), remedy))
    }

    /// An error about the table as a whole.
    pub(super) fn error(&self, problem: impl Into<String>, remedy: impl Into<String>) -> Error {
        self.source.error(self.span.clone(), problem, remedy)
    }
}

/// A value of the file, with its key.
pub(super) struct Value<'a> {
    source: Source<'a>,
    pub(super) key: &'static str,
    value: &'a Spanned<DeValue<'a>>,
    /// For an element of an array, what the array should look like.
    element_of: Option<&'static str>,
}

impl<'a> Value<'a> {
    /// An error about the value.
    pub(super) fn error(&self, problem: impl Into<String>, remedy: impl Into<String>) -> Error {
        self.source.error(self.value.span(), problem, remedy)
    }

    fn wrong_type(&self, wanted: &str, example: &str) -> Error {
        let key = self.key;
        let found = match self.value.get_ref() {
            DeValue::String(_) => "a string",
            DeValue::Integer(_) => "an integer",
            DeValue::Float(_) => "a number",
            DeValue::Boolean(_) => "a boolean",
            DeValue::Datetime(_) => "a date",
            DeValue::Array(_) => "an array",
            DeValue::Table(_) => "a table",
        };
        match self.element_of {
            None => self.error(format!("`{key}` is {found}, not {wanted}"), format!("write it like `{example}`")),
            Some(whole) => self.error(format!("`{key}` holds {found}, not {wanted}"), format!("write it like `{key} = {whole}`")),
        }
    }

    /// A table called `name` in [`KEYS`].
    pub(super) fn table(&self, name: &'static str, example: &str) -> Result<Table<'a>> {
        let DeValue::Table(table) = self.value.get_ref() else { return Err(self.wrong_type("a table", example)) };
        Table { source: self.source, name, span: self.value.span(), table }.checked()
    }

    /// An array of tables called `name` in [`KEYS`].
    pub(super) fn tables(&self, name: &'static str, example: &'static str) -> Result<Vec<Table<'a>>> {
        let items = self.array().ok_or_else(|| self.wrong_type("an array of tables", example))?;
        items.iter().map(|value| self.element(value, "[{ … }]").table(name, example)).collect()
    }

    fn element(&self, value: &'a Spanned<DeValue<'a>>, whole: &'static str) -> Self {
        Self { value, element_of: Some(whole), ..*self }
    }

    fn array(&self) -> Option<&'a DeArray<'a>> {
        match self.value.get_ref() {
            DeValue::Array(array) => Some(array),
            _ => None,
        }
    }

    /// Is it a string?
    pub(super) fn is_string(&self) -> bool {
        self.value.get_ref().is_str()
    }

    /// A string that is not empty.
    pub(super) fn string(&self) -> Result<&'a str> {
        let DeValue::String(text) = self.value.get_ref() else {
            return Err(self.wrong_type("a string", &format!("{} = \"…\"", self.key)));
        };
        if text.is_empty() {
            return Err(self.error(format!("`{}` is empty", self.key), "give a value, or leave the key out"));
        }
        Ok(text)
    }

    /// A boolean.
    pub(super) fn boolean(&self) -> Result<bool> {
        match self.value.get_ref() {
            DeValue::Boolean(b) => Ok(*b),
            _ => Err(self.wrong_type("a boolean", &format!("{} = true", self.key))),
        }
    }

    /// One of the named choices.
    pub(super) fn choice<T: Copy>(&self, choices: &[(&str, T)]) -> Result<T> {
        let text = self.string()?;
        choices.iter().find(|(name, _)| *name == text).map(|(_, value)| *value).ok_or_else(|| {
            let names: Vec<&str> = choices.iter().map(|(name, _)| *name).collect();
            let remedy = match near_miss(text, &names) {
                Some(near) => format!("did you mean `{near}`?"),
                None => format!("choose one of: {}", names.join(", ")),
            };
            self.error(format!("unknown {} `{text}`", self.key.replace('_', " ")), remedy)
        })
    }

    /// A finite number for which `allowed` holds; `range` says which those are ("in [0, 1]").
    pub(super) fn number(&self, allowed: impl Fn(f32) -> bool, range: &str) -> Result<f32> {
        let number = match self.value.get_ref() {
            DeValue::Integer(i) => i64::from_str_radix(i.as_str(), i.radix()).ok().map(|i| i as f64),
            DeValue::Float(f) => f.as_str().parse().ok(),
            _ => return Err(self.wrong_type("a number", &format!("{} = 1.0", self.key))),
        };
        // Out of f64 or i64 means out of range too.
        let number = number.unwrap_or(f64::INFINITY) as f32;
        if number.is_finite() && allowed(number) {
            return Ok(number);
        }
        let text: String = self.source.text.get(self.value.span()).unwrap_or_default().chars().take(40).collect();
        Err(self.error(format!("`{}` cannot be {text}", self.key), format!("give a number {range}")))
    }

    /// An integer in `range`.
    pub(super) fn integer(&self, range: std::ops::RangeInclusive<u32>) -> Result<u32> {
        let DeValue::Integer(i) = self.value.get_ref() else {
            return Err(self.wrong_type("an integer", &format!("{} = {}", self.key, range.end().min(&64))));
        };
        let number = i64::from_str_radix(i.as_str(), i.radix()).ok().and_then(|i| u32::try_from(i).ok());
        number.filter(|n| range.contains(n)).ok_or_else(|| {
            let remedy = format!("give an integer from {} to {}", range.start(), range.end());
            self.error(format!("`{}` cannot be {i:.40}", self.key), remedy)
        })
    }

    /// An array of exactly `N` elements.
    fn elements<const N: usize>(&self, whole: &'static str) -> Result<[Value<'a>; N]> {
        let example = format!("{} = {whole}", self.key);
        let array = self.array().ok_or_else(|| self.wrong_type(&format!("an array of {N} numbers"), &example))?;
        let items: Vec<_> = array.iter().map(|value| self.element(value, whole)).collect();
        items.try_into().map_err(|items: Vec<_>| {
            self.error(format!("`{}` has {} elements, not {N}", self.key, items.len()), format!("write it like `{example}`"))
        })
    }

    /// `N` numbers, as [`Value::number`].
    pub(super) fn numbers<const N: usize>(
        &self,
        allowed: impl Fn(f32) -> bool,
        range: &str,
        example: &'static str,
    ) -> Result<[f32; N]> {
        let mut numbers = [0.0; N];
        for (n, element) in numbers.iter_mut().zip(self.elements::<N>(example)?) {
            *n = element.number(&allowed, range)?;
        }
        Ok(numbers)
    }

    /// A colour whose channels are in [0, `max`].
    pub(super) fn color(&self, max: f32) -> Result<Vec3> {
        self.numbers(|c| (0.0..=max).contains(&c), &format!("in [0, {max}]"), "[0.5, 0.5, 0.5]").map(Vec3::from_array)
    }

    /// A width and a height in pixels, each in [1, `max`].
    pub(super) fn pixels(&self, max: u32) -> Result<(usize, usize)> {
        let [w, h] = self.elements("[1024, 512]")?;
        Ok((w.integer(1..=max)? as usize, h.integer(1..=max)? as usize))
    }
}

/// How messages name a table of [`KEYS`].
fn describe(table: &str) -> String {
    match table {
        "" => "the scene file".into(),
        "proxy" | "object" | "marker" => format!("[[{table}]]"),
        "panorama" | "camera" | "view" | "render" => format!("[{table}]"),
        _ => format!("`{table}`"),
    }
}

/// The candidate that `word` is probably a slip for: equal but for case and separators, or a third of it or less mistyped.
pub(super) fn near_miss<'c>(word: &str, candidates: &[&'c str]) -> Option<&'c str> {
    // A word much longer than any key is no slip, and comparing takes time in proportion to its length.
    if word.len() > 64 {
        return None;
    }
    let plain = |s: &str| s.chars().filter(|c| c.is_alphanumeric()).flat_map(char::to_lowercase).collect::<Vec<_>>();
    let word = plain(word);
    let scored = candidates.iter().map(|c| (edits(&word, &plain(c)), c.len(), *c));
    scored.min().filter(|&(edits, len, _)| edits <= (len.min(word.len()) / 3).max(1) && len > 1).map(|(_, _, c)| c)
}

/// Insertions, deletions, replacements and swaps of neighbours that turn `a` into `b` (optimal string alignment).
fn edits(a: &[char], b: &[char]) -> usize {
    let mut before = vec![0; b.len() + 1];
    let mut above: Vec<usize> = (0..=b.len()).collect();
    for i in 1..=a.len() {
        let mut row = vec![i; b.len() + 1];
        for j in 1..=b.len() {
            let replaced = above[j - 1] + usize::from(a[i - 1] != b[j - 1]);
            row[j] = replaced.min(above[j] + 1).min(row[j - 1] + 1);
            if i > 1 && j > 1 && a[i - 1] == b[j - 2] && a[i - 2] == b[j - 1] {
                row[j] = row[j].min(before[j - 2] + 1);
            }
        }
        before = std::mem::replace(&mut above, row);
    }
    above[b.len()]
}
