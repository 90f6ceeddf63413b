//! One self-contained page with what a study found: no script, no file beside it.

const STYLE: &str = "body{font:16px/1.45 system-ui,sans-serif;max-width:60rem;margin:2rem auto;padding:0 1rem;color:#222}\
     figure{margin:1.5rem 0}svg{max-width:100%;height:auto}li{margin:.3rem 0}pre{overflow-x:auto;background:#f5f5f5;padding:.8rem}";

/// The page as it grows.
pub struct Page {
    title: String,
    figures: Vec<String>,
}

impl Page {
    /// A page with a title.
    pub fn new(title: &str) -> Self {
        Self {
            title: escaped(title),
            figures: Vec::new(),
        }
    }

    /// Adds a picture: the text of an SVG file.
    pub fn figure(&mut self, caption: &str, svg: &str) {
        // A declaration of XML has no place inside a page.
        let svg = svg.find("<svg").map_or("", |start| &svg[start..]);
        let caption = escaped(caption);
        self.figures.push(format!(
            "<figure>\n{svg}\n<figcaption>{caption}</figcaption>\n</figure>\n"
        ));
    }

    /// The page; lines of several lines are tables.
    pub fn html(&self, lines: &[String]) -> String {
        let item = |line: &String| {
            let text = escaped(line);
            if line.contains('\n') {
                format!("<li><pre>{text}</pre></li>\n")
            } else {
                format!("<li>{text}</li>\n")
            }
        };
        let items: String = lines.iter().map(item).collect();
        let (title, figures) = (&self.title, self.figures.concat());
        format!(
            "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n<title>{title}</title>\n\
             <style>{STYLE}</style>\n</head>\n<body>\n<h1>{title}</h1>\n<ul>\n{items}</ul>\n{figures}</body>\n</html>\n"
        )
    }
}

fn escaped(text: &str) -> String {
    text.replace('&', "&amp;")
        .replace('<', "&lt;")
        .replace('>', "&gt;")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_cannot_become_markup() {
        let mut page = Page::new("<script>alert(1)</script>");
        page.figure("a < b", "<?xml version=\"1.0\"?>\n<svg></svg>");
        let html = page.html(&["x & y".into(), "two\nlines".into()]);
        assert!(!html.contains("<script>") && !html.contains("<?xml"));
        assert!(html.contains("x &amp; y") && html.contains("<pre>two\nlines</pre>"));
        assert!(html.contains("<figcaption>a &lt; b</figcaption>"));
    }
}
