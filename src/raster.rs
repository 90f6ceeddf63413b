//! Pictures as pixels beside their SVG, for slides and readers that show no SVG.

use std::path::Path;
use std::sync::{Arc, LazyLock};

use resvg::{tiny_skia, usvg};

use crate::failure::Failure;
use crate::output::{note, write_bytes, write_file};

/// Pixels for each unit of the SVG.
const SCALE: f32 = 2.0;

/// The fonts of the machine, read once.
static FONTS: LazyLock<Arc<usvg::fontdb::Database>> = LazyLock::new(|| {
    let mut fonts = usvg::fontdb::Database::new();
    fonts.load_system_fonts();
    // The pictures name these families first; a machine that has none of them shows what it has.
    if let Some(family) = ["DejaVu Sans", "Liberation Sans", "Arial", "Helvetica"]
        .into_iter()
        .find(|name| has(&fonts, name))
    {
        fonts.set_sans_serif_family(family);
    }
    if fonts.is_empty() {
        note(
            "no fonts on this machine: PNG pictures have no words (for example: apt-get install fonts-dejavu-core)",
        );
    }
    Arc::new(fonts)
});

fn has(fonts: &usvg::fontdb::Database, family: &str) -> bool {
    let families = fonts.faces().flat_map(|face| &face.families);
    families.into_iter().any(|(name, _)| name == family)
}

/// Writes a picture as the SVG that `path` names, and as PNG beside it.
pub fn write_picture(path: &Path, svg: &str) -> Result<(), Failure> {
    write_file(path, svg)?;
    match png(svg) {
        Ok(bytes) => write_bytes(&path.with_extension("png"), &bytes),
        Err(reason) => {
            note(&format!("{}: no PNG: {reason}", path.display()));
            Ok(())
        }
    }
}

/// A picture as PNG on white, two pixels for each unit of the SVG.
fn png(svg: &str) -> Result<Vec<u8>, String> {
    let options = usvg::Options {
        fontdb: FONTS.clone(),
        ..usvg::Options::default()
    };
    let tree = usvg::Tree::from_str(svg, &options).map_err(|error| error.to_string())?;
    let pixels = |length: f32| (SCALE * length).ceil().max(1.0) as u32;
    let (width, height) = (pixels(tree.size().width()), pixels(tree.size().height()));
    let mut pixmap = tiny_skia::Pixmap::new(width, height)
        .ok_or_else(|| format!("{width} x {height} pixels do not fit"))?;
    pixmap.fill(tiny_skia::Color::WHITE);
    resvg::render(
        &tree,
        tiny_skia::Transform::from_scale(SCALE, SCALE),
        &mut pixmap.as_mut(),
    );
    pixmap.encode_png().map_err(|error| error.to_string())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_picture_has_its_size_and_its_colours() {
        let svg = r##"<svg xmlns="http://www.w3.org/2000/svg" width="40" height="20" viewBox="0 0 40 20">
            <rect x="0" y="0" width="20" height="20" fill="#ff0000"/></svg>"##;
        let picture = tiny_skia::Pixmap::decode_png(&png(svg).expect("drawn")).expect("a PNG");
        assert_eq!((picture.width(), picture.height()), (80, 40));
        let colour = |x, y| {
            let pixel = picture.pixel(x, y).expect("inside").demultiply();
            [pixel.red(), pixel.green(), pixel.blue(), pixel.alpha()]
        };
        assert_eq!(colour(10, 20), [255, 0, 0, 255]);
        assert_eq!(colour(70, 20), [255, 255, 255, 255]);
        assert!(png("<svg").is_err());
    }
}
