//! `salp material list|show|fit`: the material records, and a law from a tension test.

mod fit;

use clap::{Args, Subcommand};
use salp_core::material::records::{MaterialRecord, RECORDS, find};
use salp_core::material::stability::{SEARCHED_STRETCH, Stability};
use salp_core::scene::material_document;
use serde_json::{Value, json};

use crate::failure::Failure;
use crate::output::{Output, number, table};

/// Arguments of `salp material`.
#[derive(Args)]
pub struct Material {
    #[command(subcommand)]
    verb: Verb,
}

#[derive(Subcommand)]
enum Verb {
    /// All records
    List,
    /// One record with its parameters, convention and source
    Show {
        /// Its name
        name: String,
    },
    /// Fits every law to a tension test and says which to take
    Fit(fit::Fit),
}

impl Material {
    /// Prints records.
    pub fn run(self, output: Output) -> Result<(), Failure> {
        match self.verb {
            Verb::List => {
                let all: Vec<Value> = RECORDS.iter().map(document).collect();
                output.print(&json!({ "materials": all }), list);
            }
            Verb::Show { name } => {
                let record = find(&name).ok_or_else(|| {
                    let names: Vec<&str> = RECORDS.iter().map(|r| r.name).collect();
                    let message =
                        format!("no record is named {name}; there are {}", names.join(", "));
                    Failure::fault("name", message)
                })?;
                output.print(&document(record), || text(record));
            }
            Verb::Fit(verb) => verb.run(output)?,
        }
        Ok(())
    }
}

fn document(record: &MaterialRecord) -> Value {
    json!({
        "name": record.name,
        "law": material_document(&record.law),
        "convention": record.convention(),
        "shear_modulus_mpa": record.law.shear_modulus_mpa(),
        "source": record.source,
        "fit_stretch": record.law.fit_stretch,
        "stable_to_stretch": Stability::of(&record.law),
        "elongation_at_break": record.elongation_at_break,
        "stretch_limit": record.stretch_limit(),
    })
}

fn list() -> String {
    let rows: Vec<Vec<String>> = RECORDS
        .iter()
        .map(|record| {
            vec![
                record.name.to_owned(),
                number(Some(record.law.shear_modulus_mpa())),
                number(record.stretch_limit()),
                stable_to(
                    Stability::of(&record.law)
                        .lost_in_plane_strain()
                        .map(|(_, l)| l),
                ),
            ]
        })
        .collect();
    table(&["record", "mu (MPa)", "stretch limit", "stable to"], &rows)
}

fn text(record: &MaterialRecord) -> String {
    format!(
        "{}\nlaw (MPa)      {}\nconvention     {}\nmu             {} MPa\nstretch limit  {}\nfit to stretch {}\nstable to      {}\nbreaks at      {}\nsource         {}",
        record.name,
        material_document(&record.law),
        record.convention(),
        number(Some(record.law.shear_modulus_mpa())),
        number(record.stretch_limit()),
        number(record.law.fit_stretch),
        stability(&Stability::of(&record.law)),
        record
            .elongation_at_break
            .map_or_else(|| "-".into(), |e| format!("{:.0} % elongation", 100.0 * e)),
        record.source
    )
}

fn stable_to(stretch: Option<f64>) -> String {
    stretch.map_or_else(
        || format!("{SEARCHED_STRETCH} or more"),
        |l| number(Some(l)),
    )
}

/// The stretch to which each condition holds.
fn stability(stability: &Stability) -> String {
    format!(
        "{} uniaxial, {} planar, {} equibiaxial tension (Drucker); {} ellipticity in plane strain",
        stable_to(stability.uniaxial),
        stable_to(stability.planar),
        stable_to(stability.equibiaxial),
        stable_to(stability.ellipticity)
    )
}
