//! How wide a text is: from above, since the reader's machine chooses the face.

/// What a bold letter is wider by.
const BOLD: f64 = 1.2;

/// Upper estimate of the width in px: advances of DejaVu Sans, the widest face that the pictures name, rounded up.
pub(super) fn width(text: &str, size: f64) -> f64 {
    text.chars().map(advance).sum::<f64>() * size
}

/// In parts of the font size.
fn advance(letter: char) -> f64 {
    match letter {
        'i' | 'j' | 'l' | 'I' | 'J' | '\'' => 0.3,
        ' ' | ',' | '.' | '/' | '\\' | ':' | ';' | '|' => 0.35,
        'f' | 'r' | 't' | '!' | '(' | ')' | '[' | ']' | '-' | '\u{b2}' => 0.42,
        'm' | 'M' | 'W' | '%' | '@' => 1.0,
        'w' | '#' | '+' | '<' | '=' | '>' | '^' | '~' | '&' => 0.85,
        'A'..='Z' => 0.8,
        c if c.is_ascii() => 0.64,
        '\u{b0}' => 0.5,
        _ => 1.0,
    }
}

/// Breaks text into lines of at most `limit` px; a word longer than that is broken anywhere.
pub(super) fn wrap(text: &str, limit: f64, size: f64) -> Vec<String> {
    let mut lines: Vec<String> = Vec::new();
    for word in text.split_whitespace() {
        let mut rest = word.to_owned();
        if let Some(line) = lines.last_mut() {
            let longer = format!("{line} {word}");
            if width(&longer, size) <= limit {
                *line = longer;
                continue;
            }
        }
        while width(&rest, size) > limit {
            let tail = rest.split_off(fitting(&rest, limit, size));
            lines.push(std::mem::replace(&mut rest, tail));
        }
        if !rest.is_empty() {
            lines.push(rest);
        }
    }
    lines
}

/// A bold line of at most `limit` px; what does not fit becomes an ellipsis.
pub(super) fn shortened_bold(text: &str, limit: f64, size: f64) -> String {
    let size = BOLD * size;
    if width(text, size) <= limit {
        return text.to_owned();
    }
    let ellipsis = '\u{2026}';
    let kept = fitting(text, limit - advance(ellipsis) * size, size);
    format!("{}{ellipsis}", text[..kept].trim_end())
}

/// Bytes of the longest beginning that fits: at least one letter.
fn fitting(text: &str, limit: f64, size: f64) -> usize {
    let mut used = 0.0;
    let mut letters = text.char_indices();
    let first = letters.next().map_or(0, |(_, letter)| {
        used = advance(letter) * size;
        letter.len_utf8()
    });
    for (at, letter) in letters {
        used += advance(letter) * size;
        if used > limit {
            return at.max(first);
        }
    }
    text.len()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn widths_are_bounds_that_are_not_far_off() {
        // Advances of DejaVu Sans and DejaVu Sans Bold at 1 px.
        for (text, plain, bold) in [
            ("restart 0 (paper, counter-clockwise)", 17.875, 20.244),
            ("walls overlap: not counted", 13.262, 15.020),
            (
                "asymmetric-bending: objective against CPU time",
                24.498,
                27.571,
            ),
            (
                "walls \u{2265} 2 mm; corners \u{2265} 3\u{b0}",
                13.884,
                15.271,
            ),
        ] {
            let estimate = width(text, 1.0);
            assert!(estimate >= plain && BOLD * estimate >= bold, "{text}");
            assert!(estimate < 1.15 * plain, "{text}: {estimate}");
        }
    }

    #[test]
    fn lines_fit_and_lose_nothing() {
        let long = "w".repeat(90);
        for text in ["", "a", "one two three four five", long.as_str()] {
            let lines = wrap(text, 60.0, 12.0);
            assert!(lines.iter().all(|line| width(line, 12.0) <= 60.0));
            let joined: String = lines.concat().split_whitespace().collect();
            assert_eq!(joined, text.split_whitespace().collect::<String>());
        }
        assert_eq!(wrap("\u{2192}\u{2192}", 1.0, 12.0).len(), 2);
    }

    #[test]
    fn long_titles_end_in_an_ellipsis() {
        assert_eq!(shortened_bold("short", 600.0, 15.0), "short");
        let cut = shortened_bold(&"\u{e4}b ".repeat(99), 600.0, 15.0);
        assert!(cut.ends_with('\u{2026}') && width(&cut, BOLD * 15.0) <= 600.0);
    }
}
