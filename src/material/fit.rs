//! `salp material fit`: laws from a tension test.

use std::path::PathBuf;

use clap::Args;
use salp_core::material::closed_form::uniaxial_stress;
use salp_core::material::fit::{
    Criterion, ErrorBasis, FAMILIES, Family, LawFit, MaterialFit, Parameter, RELATIVE_FROM,
    TensionTest, fit, read_csv,
};
use salp_core::picture::TensionPicture;
use salp_core::scene::material_document;
use serde_json::{Map, Value, json};

use super::{stability, stable_to};
use crate::failure::Failure;
use crate::output::{Output, number, table, write_file};

/// Points of a drawn curve.
const DRAWN: usize = 200;

/// Arguments of `salp material fit`.
#[derive(Args)]
pub struct Fit {
    /// CSV file: columns stretch or strain_percent, stress_mpa or stress_kpa (nominal), and specimen if there are several
    data: PathBuf,
    /// Prints the record of this law instead of the chosen one's
    #[arg(long)]
    law: Option<String>,
    /// Writes data and curves as a picture
    #[arg(long)]
    svg: Option<PathBuf>,
}

impl Fit {
    /// Fits, and prints what came out.
    pub fn run(self, output: Output) -> Result<(), Failure> {
        let asked = self.law.as_deref().map(family).transpose()?;
        let text = std::fs::read_to_string(&self.data).map_err(|why| {
            let path = self.data.display().to_string();
            Failure::fault(path, format!("cannot be read: {why}"))
        })?;
        let test = read_csv(&text)?;
        let found = fit(&test);
        if let Some(path) = &self.svg {
            let name = self.data.file_stem().unwrap_or_default().to_string_lossy();
            write_file(path, &picture(&name, &test, &found))?;
        }
        let taken = match asked {
            Some(law) => found.of(law),
            None => found.chosen(),
        };
        output.print(&document(&test, &found, taken), || {
            people(&test, &found, taken)
        });
        match (taken, asked) {
            (Some(_), _) => Ok(()),
            (None, Some(_)) => Err(Failure::Run(
                "the data do not bear the law that was asked for",
            )),
            (None, None) => Err(Failure::Run(
                "no law fits the data and is stable within them",
            )),
        }
    }
}

fn family(name: &str) -> Result<Family, Failure> {
    let known = FAMILIES.into_iter().find(|f| f.name() == name);
    known.ok_or_else(|| {
        let names = FAMILIES.map(Family::name).join(", ");
        Failure::fault("law", format!("no law is named {name}; there are {names}"))
    })
}

/// What a study or scene takes: without the range where the law is unstable within it, which would be a fault.
fn record(law: &LawFit) -> Value {
    let mut material = law.material;
    if law.unusable.is_some() {
        material.fit_stretch = None;
    }
    material_document(&material)
}

/// The same as a line of TOML.
fn toml_line(law: &LawFit) -> String {
    fn inline(value: &Value) -> String {
        match value {
            Value::Object(map) => {
                let fields = map.iter().map(|(k, v)| format!("{k} = {}", inline(v)));
                format!("{{ {} }}", fields.collect::<Vec<_>>().join(", "))
            }
            Value::Array(list) => {
                let list: Vec<String> = list.iter().map(inline).collect();
                format!("[{}]", list.join(", "))
            }
            // Text and numbers are written alike in both languages.
            value => value.to_string(),
        }
    }
    format!("material = {}", inline(&record(law)))
}

fn document(test: &TensionTest, found: &MaterialFit, taken: Option<&LawFit>) -> Value {
    let mut document = fields(found);
    let laws = found.laws.iter().map(|law| {
        let mut map = fields(law);
        map.insert("record".into(), record(law));
        Value::Object(map)
    });
    document.insert("laws".into(), laws.collect());
    document.insert("comments".into(), json!(test.comments));
    document.insert("ignored_columns".into(), json!(test.ignored));
    let taken = taken.map(|law| {
        json!({
            "law": law.law,
            "material": record(law),
            "toml": toml_line(law),
        })
    });
    document.insert("record".into(), json!(taken));
    Value::Object(document)
}

fn fields(of: &impl serde::Serialize) -> Map<String, Value> {
    match serde_json::to_value(of) {
        Ok(Value::Object(map)) => map,
        _ => Map::new(),
    }
}

fn people(test: &TensionTest, found: &MaterialFit, taken: Option<&LawFit>) -> String {
    let [low, high] = found.stretch.map(|l| number(Some(l)));
    let mut text = format!(
        "{} rows of {} specimen{}, stretch {low} to {high}\n",
        found.rows,
        found.specimens,
        if found.specimens == 1 { "" } else { "s" }
    );
    for column in &test.ignored {
        text += &format!("column \"{column}\" was not read\n");
    }
    text.push('\n');
    let rows: Vec<Vec<String>> = found.laws.iter().map(row).collect();
    let header = [
        "law",
        "rms (MPa)",
        "rms",
        "largest",
        "at stretch",
        "AICc",
        "unseen (MPa)",
        "mu (MPa)",
        "p/mu",
        "stable to",
        "",
    ];
    text += &table(&header, &rows);
    text += &format!(
        "\n\nrms, largest: of residual over stress, where the stress is above {:.0} % of its largest; p/mu at 15 kPa;\nunseen: residuals of each specimen against the fit of the others; stable: Drucker and ellipticity in plane strain\n",
        100.0 * RELATIVE_FROM
    );
    for law in &found.left_out {
        text += &format!("{} was left out: {}\n", law.law.name(), law.why);
    }
    for law in &found.laws {
        if let Some(why) = &law.unusable {
            text += &format!("{} is not to be used: {why}\n", law.law.name());
        }
    }
    let Some(law) = taken else { return text };
    let why = match (found.chosen == Some(law.law), found.chosen_by) {
        (false, _) => "asked for",
        (true, Criterion::Aicc) => "least AICc of those to be used",
        (true, Criterion::CrossValidation) => {
            "fewest parameters within 5 % of the least error on unseen specimens"
        }
    };
    let rest_on = match found.errors_rest_on {
        ErrorBasis::IndependentResiduals => "if the residuals of all rows are independent",
        ErrorBasis::SpreadOfSpecimens => "by the spread of the specimens",
    };
    text += &format!("\n{} ({why}), 95 % intervals {rest_on}:\n", law.law.name());
    for parameter in &law.parameters {
        text += &format!("  {}\n", parameter_line(parameter));
    }
    text += &format!("stable to: {}\n", stability(&law.stable_to_stretch));
    text += &format!("\nfor a study (TOML):\n{}\n", toml_line(law));
    text += &format!("for a scene (JSON):\n\"material\": {}\n", record(law));
    text
}

fn row(law: &LawFit) -> Vec<String> {
    let percent = |x: f64| format!("{:.2} %", 100.0 * x);
    vec![
        law.law.name().to_owned(),
        number(Some(law.rms_mpa)),
        percent(law.relative_rms),
        percent(law.relative_max),
        number(Some(law.relative_max_at_stretch)),
        law.aicc.map_or_else(|| "-".into(), |a| format!("{a:.1}")),
        number(law.cross_validation_mpa),
        number(Some(law.shear_modulus_mpa)),
        number(Some(law.p_over_mu_at_15_kpa)),
        stable_to(law.stable_to_stretch.lost_in_plane_strain().map(|(_, l)| l)),
        law.unusable.as_ref().map_or("", |_| "unusable").into(),
    ]
}

fn parameter_line(parameter: &Parameter) -> String {
    let Parameter { name, value, .. } = parameter;
    let value = number(Some(*value));
    match (parameter.standard_error, parameter.interval) {
        (Some(error), Some([low, high])) => format!(
            "{name:10} {value}  standard error {}, {} to {}",
            number(Some(error)),
            number(Some(low)),
            number(Some(high))
        ),
        _ => format!("{name:10} {value}  not determined by the data alone"),
    }
}

fn picture(name: &str, test: &TensionTest, found: &MaterialFit) -> String {
    let [low, high] = found.stretch;
    let at = |i: usize| low + (high - low) * i as f64 / DRAWN as f64;
    let curves = found.laws.iter().map(|law| {
        let points = (0..=DRAWN).map(|i| [at(i), uniaxial_stress(&law.material, at(i))]);
        let marks = match (&law.unusable, found.chosen == Some(law.law)) {
            (Some(_), _) => ", unusable",
            (None, true) => ", chosen",
            (None, false) => "",
        };
        let rms = 100.0 * law.relative_rms;
        let label = format!("{} ({rms:.1} %{marks})", law.law.name());
        (label, points.collect())
    });
    let mut caption = vec![format!(
        "Circles: {} rows of {} specimen(s). Lines: incompressible laws in uniaxial tension by least squares of the nominal stress; in brackets the root of the mean square of residual over stress.",
        found.rows, found.specimens
    )];
    if !test.comments.is_empty() {
        caption.push(test.comments.join(" "));
    }
    TensionPicture {
        title: format!("{name}: laws fitted to a tension test"),
        points: test.points().collect(),
        curves: curves.collect(),
        caption,
    }
    .svg()
}
