//! The study document, resolved: what is designed, from what, by which optimiser, from which starts.
//!
//! Every type serialises to the form of the document, so that [`Study::document`] reads back to an equal study. Lengths
//! in mm, stress in MPa, pressure in kPa.

use serde::{Serialize, Serializer};
use serde_json::{Value, json};

use super::race::Competition;
use super::result::is_false;
use super::takes::{Given, Pass, Simplification, Take};
use crate::actuation::ActuationCycle;
use crate::geometry::{ChamberCorners, Layout, Point};
use crate::material::{MaterialLaw, records};
use crate::optimiser::OptimiserOptions;
use crate::reduced::LinearTransform;
use crate::scene::measure::{Bound, Goal, Measure};
use crate::scene::{ContactMode, ElementChoice, MeshRequest, Orientation, material_document};

/// A study whose document had no fault.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Study {
    /// Its name, for people and for the default folder of results.
    pub name: String,
    /// What the finite-element models of the steps share; `None` where every step is a command model.
    #[serde(flatten)]
    pub body: Option<StudyBody>,
    /// Whether workers of any build and instruction set may join: its history is then the same to solver tolerance only.
    #[serde(skip_serializing_if = "is_false")]
    pub mixed_hardware: bool,
    /// Whether each new best so far of a finite-element step is evaluated on a second mesh too.
    #[serde(skip_serializing_if = "is_true")]
    pub error_bands: bool,
    /// Whether workers that nothing else needs evaluate what an optimiser will probably ask next.
    #[serde(skip_serializing_if = "is_false")]
    pub speculate: bool,
    /// The steps, in the document's order.
    #[serde(rename = "step")]
    pub steps: Vec<StudyStep>,
}

/// Actuator, material and actuation of the finite-element models.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct StudyBody {
    /// The chain of units and where its chambers may lie.
    pub actuator: StudyActuator,
    /// What it is made of.
    #[serde(flatten)]
    pub material: StudyMaterials,
    /// Pressures over pseudo-time.
    #[serde(serialize_with = "actuation_as_document")]
    pub actuation: ActuationCycle,
}

/// A chain of units of one size and the domains of their chambers.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct StudyActuator {
    /// Width and height of a unit.
    pub unit_mm: [f64; 2],
    /// Number of units.
    pub units: usize,
    /// Which chambers a unit holds.
    pub layout: Layout,
    /// Corners of each chamber.
    #[serde(skip_serializing_if = "is_four")]
    pub corners: ChamberCorners,
    /// Least distance from a chamber's domain to the unit's boundary, and between the two domains.
    pub wall_mm: f64,
    /// Distance that each corner keeps from the centre lines of its chamber's domain.
    pub centre_clearance_mm: f64,
    /// Radius of the chambers' corners; 0: sharp. The variables are the unrounded corners.
    pub corner_radius_mm: f64,
}

/// What the units are made of.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub enum StudyMaterials {
    /// All of one material.
    #[serde(rename = "material")]
    All(StudyMaterial),
    /// One material per unit.
    #[serde(rename = "unit_materials")]
    PerUnit(Vec<StudyMaterial>),
}

/// A law, and the record that it comes from.
#[derive(Clone, Debug, PartialEq)]
pub struct StudyMaterial {
    /// Name of the record; `None` for a law that the document gives itself.
    pub record: Option<String>,
    /// Parameters.
    pub law: MaterialLaw,
}

/// One step: an optimisation from several starts.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct StudyStep {
    /// Its name, unique in the study.
    pub id: String,
    /// Level of the framework, from 1 (the whole actuator) upwards (simpler models).
    pub level: usize,
    /// Pass of the framework.
    #[serde(skip_serializing_if = "is_backward")]
    pub pass: Pass,
    /// By what it stands for the level above it.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub simplifies: Vec<Simplification>,
    /// What it takes from other steps.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub takes: Vec<Take>,
    /// What it was given by them; empty in a document.
    #[serde(skip)]
    pub given: Given,
    /// What is minimised; `None` for a command model, which gives its objective itself.
    pub target: Option<Target>,
    /// What evaluates a design.
    pub model: Model,
    /// What may vary, and between which bounds.
    pub variables: Variables,
    /// What must hold.
    pub constraints: StepConstraints,
    /// Who chooses the next design.
    pub optimiser: OptimiserOptions,
    /// Where it starts; a sweep and an exchange descent have no starts.
    #[serde(skip_serializing_if = "Restarts::is_empty")]
    pub restarts: Restarts,
    /// When it must end at the latest.
    pub budget: Budget,
    /// How many distinct candidates are kept.
    pub keeps: usize,
}

/// What is minimised over the actuation cycle.
#[derive(Clone, Debug, PartialEq)]
pub struct Target {
    /// The measure, of points in the reference shape, and what is done with it.
    pub goal: Goal<Point>,
    /// Whether an enclosed area counts in either sense: each start becomes two restarts, one of each sense; a sweep is one
    /// restart, whose points count in their better sense.
    pub either_sense: bool,
}

/// What evaluates a design.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[serde(tag = "kind", rename_all = "snake_case")]
pub enum Model {
    /// Finite elements on a chain of copies of one unit.
    FeCascade(FeModel),
    /// Finite elements on a chain whose units are all free.
    FeDirect(FeModel),
    /// Finite elements on one unit of each of several chamber layouts.
    FeLayouts(FeLayoutsModel),
    /// The reduced model of a chain: a transformation of a unit per actuation (Eq. 1).
    LinearTransform(ReducedModel),
    /// The reduced model of a chain: constant strains of a unit per actuation.
    ConstantStrain(ReducedModel),
    /// A program.
    Command(CommandModel),
}

/// One unit of each of several chamber layouts, each with equal rectangles in its domains: how near do its transformations come
/// to what is asked for?
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct FeLayoutsModel {
    /// The layouts on offer; the first variable is an index into them.
    pub layouts: Vec<Layout>,
    /// Transformations of a unit that are asked for, one per loaded row of the schedule; empty where another step gives them.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub behaviour: Vec<LinearTransform>,
    /// By what a unit is held against them.
    pub score: LayoutScore,
    /// Settings of the elements.
    #[serde(flatten)]
    pub fe: FeModel,
}

/// How near a unit comes to transformations that are asked for.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum LayoutScore {
    /// What is missing of the area that a cascade of them encloses, 1 - |A| / |A asked|.
    #[default]
    Area,
    /// The distance of the entries over that of the asked ones from rest.
    Distance,
}

/// A reduced model of a chain of equal units.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
pub struct ReducedModel {
    /// Number of units; `None`: that of the actuator.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub units: Option<usize>,
    /// Number of actuations, each a transformation of a unit, or its strains; the last one is followed by rest.
    pub actuations: usize,
}

/// Settings of a finite-element model.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct FeModel {
    /// Number of units; `None`: that of the actuator.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub units: Option<usize>,
    /// Element family.
    pub element: ElementChoice,
    /// No element edge longer than this; `None`: the size rule for 1 % of the tip displacement.
    pub max_size_mm: Option<f64>,
    /// As many elements as squares of this side fill the solid, in place of a longest edge.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub mean_size_mm: Option<f64>,
    /// A state is accepted when its largest free nodal residual is below this times the largest nodal force.
    pub relative_residual_force_tolerance: f64,
    /// Self-contact.
    pub contact: ContactMode,
    /// Surfaces farther apart than this do not act on each other, mm.
    pub contact_activation_mm: f64,
    /// The error for which element and size are chosen, where the document asks for that.
    #[serde(rename = "mesh", skip_serializing_if = "Option::is_none")]
    pub accuracy: Option<MeshAccuracy>,
}

impl FeModel {
    /// The mesh that a scene of this model asks for.
    pub(crate) fn mesh(&self) -> MeshRequest {
        MeshRequest {
            element: self.element,
            max_size_mm: self.max_size_mm,
            mean_size_mm: self.mean_size_mm,
        }
    }
}

/// Element and size chosen for an error.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct MeshAccuracy {
    /// The relative error wanted in the tip's displacement and in the enclosed area.
    pub error: f64,
    /// What was found; `None` until element and size are chosen, which is before a study is stored: every worker then has
    /// the same settings.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub chosen: Option<ChosenMesh>,
}

/// What the chosen element and size were seen to do.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ChosenMesh {
    /// The design at which errors were measured.
    pub at: AccuracyDesign,
    /// Error of the tip at the rows of the schedule, over its largest displacement.
    pub tip_error: f64,
    /// Relative error of the enclosed area, where that is the target.
    pub area_error: Option<f64>,
    /// How uncertain the reference is, relative, in the larger of the two; part of what must be within the wanted error.
    pub uncertainty: f64,
    /// Number of elements there.
    pub elements: usize,
}

/// A design at which errors are measured.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum AccuracyDesign {
    /// The first given start.
    Given,
    /// The middle of the bounds: the paper's start, a void of 1 x 1 mm, says nothing of what comes after it.
    Middle,
}

/// A program that answers lines of JSON; its form is described in the user's guide.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct CommandModel {
    /// Program and arguments; paths are relative to the study file.
    pub argv: Vec<String>,
    /// Seconds after which an evaluation counts as failed.
    pub time_limit_s: f64,
    /// Whether it gives gradients.
    pub gradient: bool,
}

/// What may vary.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[serde(untagged)]
pub enum Variables {
    /// Chamber corners, bounded by the boxes of the actuator's layout.
    Chambers {
        /// How the variables give the corners.
        parametrisation: Parametrisation,
        /// Corners of each chamber, where they are not as many as the actuator's.
        #[serde(skip_serializing_if = "Option::is_none")]
        corners: Option<ChamberCorners>,
    },
    /// The variables of a command model.
    Bounds {
        /// Lower bounds.
        lower: Vec<f64>,
        /// Upper bounds.
        upper: Vec<f64>,
    },
}

/// How design variables give chamber corners.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Parametrisation {
    /// `[x1, y1, ..., x8, y8]` (Eq. 2), of hexagons to `y12`: the corners themselves, chamber after chamber; with free units one such list after
    /// the other, from the clamped end.
    Corners,
    /// `[width, height]`: two equal rectangles, each at its domain's centre.
    Rectangle,
    /// One index for each free unit, from 0, into the units that the step takes from others as its alphabet.
    Sequence,
}

/// What must hold, feasible when <= 0.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[serde(untagged)]
pub enum StepConstraints {
    /// Of finite-element models: spike rows and wall rows of each free unit, then a stretch row per chamber corner of a
    /// unit, another at the load margin, a gap row per chamber of a unit, and a row per end of each bound.
    Chambers(ChamberConstraints),
    /// Of command models: how many values the program gives.
    Counts {
        /// Feasible when <= 0.
        inequalities: usize,
        /// Feasible when 0; they follow the inequalities.
        equalities: usize,
    },
}

/// Constraints of a finite-element model.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ChamberConstraints {
    /// Least wall thickness t_min: 1 - t / t_min <= 0.
    pub wall_mm: f64,
    /// Least interior angle of a chamber's corner, degrees.
    pub spike_deg: f64,
    /// Limit of the averaged principal stretch.
    pub stretch: StretchLimit,
    /// Radius of the disc over which the stretch is averaged.
    pub stretch_length_mm: f64,
    /// Least gap between facing walls of a chamber, mm.
    pub wall_gap_mm: NumberOrOff,
    /// Stable equilibria that keep the stretch limit exist up to this many times every loaded row of the schedule.
    pub load_margin: NumberOrOff,
    /// Whether a design counts as failed whose path meets a second equilibrium.
    pub exclude_non_unique: bool,
    /// Bounds on measures over the path.
    #[serde(serialize_with = "bounds_as_documents")]
    pub bounds: Vec<Bound<Point>>,
}

/// A limit that may be switched off.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum NumberOrOff {
    /// The limit.
    Number(f64),
    /// None.
    Off,
}

impl NumberOrOff {
    /// The number; `None` where it is off.
    pub fn number(self) -> Option<f64> {
        match self {
            Self::Number(value) => Some(value),
            Self::Off => None,
        }
    }
}

/// Limit of the averaged principal stretch.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum StretchLimit {
    /// That of the material's record.
    Material,
    /// A number above 1.
    Value(f64),
    /// None.
    Off,
}

/// Where the optimiser starts.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Restarts {
    /// Kinds of starts, in their order.
    pub start: Vec<StartKind>,
    /// The points of `given`.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub points: Vec<Vec<f64>>,
    /// How many starts each kind draws that draws them.
    #[serde(skip_serializing_if = "is_zero")]
    pub count: usize,
    /// Seed of what is drawn.
    pub seed: u64,
    /// A start nearer than this to another one is drawn again: the largest difference of a variable over its range.
    #[serde(skip_serializing_if = "is_the_default_distance")]
    pub least_distance: f64,
    /// How they compete.
    #[serde(flatten)]
    pub competition: Competition,
}

/// A kind of start.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, serde::Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum StartKind {
    /// The paper's: a void of 1 x 1 mm at the centre of every chamber's domain.
    Paper,
    /// Points of the document.
    Given,
    /// Candidates of other steps.
    Taken,
    /// Points drawn uniformly from the bounds.
    Random,
    /// Points of a Latin hypercube: of `count` strata of each variable every one has one.
    LatinHypercube,
    /// Points of a scrambled Sobol sequence.
    Sobol,
}

impl StartKind {
    /// Whether its starts are drawn: `count` of them.
    pub fn is_drawn(self) -> bool {
        matches!(self, Self::Random | Self::LatinHypercube | Self::Sobol)
    }
}

/// The least distance of two starts where a document gives none.
pub const LEAST_DISTANCE: f64 = 0.01;

/// When a step must end at the latest.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Budget {
    /// Evaluations of the step, shared equally between its restarts so that the outcome does not depend on who is first.
    pub evaluations: Option<usize>,
}

impl FeModel {
    /// Whether element and size have still to be chosen for an error.
    pub fn is_unchosen(&self) -> bool {
        self.accuracy.as_ref().is_some_and(|a| a.chosen.is_none())
    }
}

impl Model {
    /// The settings of a finite-element model; `None` for a program.
    pub fn finite_elements(&self) -> Option<&FeModel> {
        match self {
            Self::FeCascade(model) | Self::FeDirect(model) => Some(model),
            Self::FeLayouts(_)
            | Self::LinearTransform(_)
            | Self::ConstantStrain(_)
            | Self::Command(_) => None,
        }
    }

    /// A reduced model with the number of its variables per actuation.
    pub fn reduced(&self) -> Option<(&ReducedModel, usize)> {
        match self {
            Self::LinearTransform(model) => Some((model, 4)),
            Self::ConstantStrain(model) => Some((model, 3)),
            Self::FeCascade(_) | Self::FeDirect(_) | Self::FeLayouts(_) | Self::Command(_) => None,
        }
    }

    /// Number of units where it is not the actuator's.
    pub fn units(&self) -> Option<usize> {
        match self {
            Self::FeCascade(model) | Self::FeDirect(model) => model.units,
            Self::FeLayouts(_) => Some(1),
            Self::LinearTransform(model) | Self::ConstantStrain(model) => model.units,
            Self::Command(_) => None,
        }
    }

    /// The same without a number of units of its own.
    #[must_use]
    pub fn without_units(&self) -> Self {
        let mut model = self.clone();
        match &mut model {
            Self::FeCascade(model) | Self::FeDirect(model) => model.units = None,
            Self::LinearTransform(model) | Self::ConstantStrain(model) => model.units = None,
            Self::FeLayouts(_) | Self::Command(_) => {}
        }
        model
    }

    /// Whether the variables describe every unit of the chain, rather than one for all.
    pub fn is_direct(&self) -> bool {
        matches!(self, Self::FeDirect(_))
    }
}

impl Study {
    /// The resolved document: every default filled in; it reads back to an equal study.
    pub fn document(&self) -> Value {
        // The types hold nothing that JSON cannot express: finite numbers, text keys.
        serde_json::to_value(self).unwrap_or_default()
    }
}

impl StudyBody {
    /// The stretch limit of a step's constraints as a number; `None` where it is off.
    pub fn stretch_limit(&self, constraints: &ChamberConstraints) -> Option<f64> {
        match constraints.stretch {
            StretchLimit::Off => None,
            StretchLimit::Value(limit) => Some(limit),
            StretchLimit::Material => self.material.stretch_limit(),
        }
    }
}

impl StudyMaterials {
    /// The law of each of `units` units.
    pub fn laws(&self, units: usize) -> Vec<MaterialLaw> {
        match self {
            Self::All(material) => vec![material.law; units],
            Self::PerUnit(materials) => materials.iter().map(|m| m.law).collect(),
        }
    }

    /// The materials, one for all or one per unit.
    pub fn each(&self) -> &[StudyMaterial] {
        match self {
            Self::All(material) => std::slice::from_ref(material),
            Self::PerUnit(materials) => materials,
        }
    }

    /// The least of their stretch limits, where every one has one.
    pub fn stretch_limit(&self) -> Option<f64> {
        let limits: Option<Vec<f64>> = self
            .each()
            .iter()
            .map(StudyMaterial::stretch_limit)
            .collect();
        limits?.into_iter().reduce(f64::min)
    }
}

impl StudyMaterial {
    /// The stretch limit of its record, or the end of the range that its document gives, where it has one.
    pub fn stretch_limit(&self) -> Option<f64> {
        match &self.record {
            Some(name) => records::find(name)?.stretch_limit(),
            None => self.law.fit_stretch,
        }
    }
}

impl Target {
    /// The senses in which restarts run; `None` for a target without one.
    pub fn senses(&self) -> Vec<Option<Orientation>> {
        match self.goal.measure {
            Measure::EnclosedArea { .. } if self.either_sense => vec![
                Some(Orientation::CounterClockwise),
                Some(Orientation::Clockwise),
            ],
            Measure::EnclosedArea { orientation, .. } => vec![Some(orientation)],
            _ => vec![None],
        }
    }
}

impl Serialize for Target {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let mut map = self.goal.document("_mm", |p| json!(p));
        if self.either_sense {
            map.insert("orientation".into(), json!("either"));
        }
        map.serialize(serializer)
    }
}

fn bounds_as_documents<S: Serializer>(
    bounds: &[Bound<Point>],
    serializer: S,
) -> Result<S::Ok, S::Error> {
    serializer.collect_seq(bounds.iter().map(|b| b.document("_mm", |p| json!(p))))
}

impl Serialize for StudyMaterial {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        match &self.record {
            Some(name) => serializer.serialize_str(name),
            None => material_document(&self.law).serialize(serializer),
        }
    }
}

impl Serialize for StretchLimit {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        match self {
            Self::Material => serializer.serialize_str("material"),
            Self::Value(limit) => serializer.serialize_f64(*limit),
            Self::Off => serializer.serialize_str("off"),
        }
    }
}

impl Serialize for NumberOrOff {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        match self {
            Self::Number(value) => serializer.serialize_f64(*value),
            Self::Off => serializer.serialize_str("off"),
        }
    }
}

fn actuation_as_document<S: Serializer>(
    cycle: &ActuationCycle,
    serializer: S,
) -> Result<S::Ok, S::Error> {
    crate::scene::actuation::actuation_document(cycle).serialize(serializer)
}

#[expect(
    clippy::trivially_copy_pass_by_ref,
    reason = "the signature that serde asks for"
)]
fn is_backward(pass: &Pass) -> bool {
    *pass == Pass::Backward
}

#[expect(
    clippy::trivially_copy_pass_by_ref,
    reason = "the signature that serde asks for"
)]
fn is_four(corners: &ChamberCorners) -> bool {
    *corners == ChamberCorners::Four
}

#[expect(
    clippy::trivially_copy_pass_by_ref,
    reason = "the signature that serde asks for"
)]
fn is_true(flag: &bool) -> bool {
    *flag
}

#[expect(
    clippy::trivially_copy_pass_by_ref,
    reason = "the signature that serde asks for"
)]
fn is_zero(count: &usize) -> bool {
    *count == 0
}

#[expect(
    clippy::trivially_copy_pass_by_ref,
    reason = "the signature that serde asks for"
)]
fn is_the_default_distance(distance: &f64) -> bool {
    *distance == LEAST_DISTANCE
}
