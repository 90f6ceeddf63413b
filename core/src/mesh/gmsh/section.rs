//! Sections of a Gmsh file and the words in them, with line numbers.

use std::str::{FromStr, SplitWhitespace};

use super::error::GmshError;

/// A section `$Name ... $EndName`.
pub(super) struct Section<'a> {
    pub name: &'a str,
    /// Line of `$Name`, from 1.
    pub line: usize,
    pub body: Vec<&'a str>,
}

/// Splits a text into its sections.
pub(super) fn sections(text: &str) -> Result<Vec<Section<'_>>, GmshError> {
    let mut found: Vec<Section<'_>> = Vec::new();
    let mut lines = text.lines().enumerate();
    while let Some((index, line)) = lines.next() {
        let line = line.trim();
        if line.is_empty() {
            continue;
        }
        let Some(name) = line.strip_prefix('$') else {
            return Err(GmshError::Stray {
                line: index + 1,
                found: line.chars().take(40).collect(),
            });
        };
        let mut body = Vec::new();
        let mut closed = false;
        for (_, line) in lines.by_ref() {
            let end = line.trim().strip_prefix("$End");
            if end.is_some_and(|end| end == name) {
                closed = true;
                break;
            }
            if line.trim_start().starts_with('$') {
                break;
            }
            body.push(line);
        }
        if !closed {
            return Err(GmshError::Unclosed {
                section: name.to_owned(),
                line: index + 1,
            });
        }
        found.push(Section {
            name,
            line: index + 1,
            body,
        });
    }
    Ok(found)
}

/// The words of a section in order.
pub(super) struct Words<'a> {
    section: &'static str,
    lines: std::slice::Iter<'a, &'a str>,
    of_line: SplitWhitespace<'a>,
    /// Line of the last word, from 1.
    pub line: usize,
}

impl<'a> Words<'a> {
    pub fn new(name: &'static str, section: &'a Section<'a>) -> Self {
        Self {
            section: name,
            lines: section.body.iter(),
            of_line: "".split_whitespace(),
            line: section.line,
        }
    }

    fn next_word(&mut self) -> Option<&'a str> {
        loop {
            if let Some(word) = self.of_line.next() {
                return Some(word);
            }
            self.of_line = self.lines.next()?.split_whitespace();
            self.line += 1;
        }
    }

    /// The next word as a number.
    pub fn number<T: FromStr>(&mut self, what: &'static str) -> Result<T, GmshError> {
        let word = self.next_word().ok_or(GmshError::Short {
            section: self.section,
            line: self.line + 1,
            what,
        })?;
        word.parse().map_err(|_| GmshError::Malformed {
            line: self.line,
            what,
            found: word.chars().take(40).collect(),
        })
    }

    /// The next word as a finite number.
    pub fn finite(&mut self, what: &'static str) -> Result<f64, GmshError> {
        let value: f64 = self.number(what)?;
        if value.is_finite() {
            Ok(value)
        } else {
            Err(GmshError::Malformed {
                line: self.line,
                what,
                found: value.to_string(),
            })
        }
    }

    /// Passes over some words.
    pub fn skip(&mut self, count: usize, what: &'static str) -> Result<(), GmshError> {
        for _ in 0..count {
            self.finite(what)?;
        }
        Ok(())
    }

    /// Fails if words are left.
    pub fn end(mut self) -> Result<(), GmshError> {
        match self.next_word() {
            None => Ok(()),
            Some(_) => Err(GmshError::Long {
                section: self.section,
                line: self.line,
            }),
        }
    }
}
