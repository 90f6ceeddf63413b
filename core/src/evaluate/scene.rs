//! A scene from the resolved document to its answer.

use super::analysis::{Analysis, Measured, Wanted, analyse};
use super::answer::{
    LeftOut, MeshAnswer, SceneAnswer, SceneStatus, StateAnswer, StateContactAnswer,
};
use super::contact::{contact_answer, contact_of, halved_activation};
use super::measure::{PlacedProbe, Weight, by_name, tip_displacements};
use super::notes;
use crate::adjoint::NodeGradient;
use crate::equilibrium::{Control, NotConverged, Observer, PathEnd, PathWork, Settings};
use crate::fault::Faults;
use crate::geometry::{Actuator, InfeasibleGeometry, MeshPlan, PlanElement};
use crate::material::MaterialLaw;
use crate::mesh::{Discretisation, ElementKind, MappedMesh, build, gmsh, locate};
use crate::objective::enclosed_area;
use crate::objective::probe::ProbePoint;
use crate::scene::{Body, ContactMode, ElementChoice, Goal, MeshRequest, Scene};
use crate::study::OverlapReport;

/// Radius of the averaging disc of the reported stretch, mm.
pub const STRETCH_LENGTH_MM: f64 = 0.5;

/// What is wanted beside the answer.
#[derive(Clone, Debug, Default)]
pub struct SceneOptions {
    /// The objective's derivative with respect to node positions.
    pub gradient: bool,
    /// Displacement fields of all states.
    pub fields: bool,
    /// A mesh plan to use instead of the scene's own choice.
    pub plan: Option<MeshPlan>,
    /// Leaves stretch, gaps and crossings out.
    pub path_only: bool,
    /// What leads the path.
    pub control: Control,
}

/// The source of a body's node positions.
pub enum BodySource {
    /// A chain of units.
    Mapped(Box<MappedMesh>),
    /// A mesh file.
    File(Box<gmsh::MeshFileModel>),
}

/// A solved scene.
pub struct SceneSolution {
    /// The document.
    pub answer: SceneAnswer,
    /// The body, for pictures.
    pub body: Option<Discretisation>,
    /// Displacement fields per state of the path, where wanted.
    pub fields: Vec<Vec<[f64; 2]>>,
    /// d objective / d node position, where wanted and the path is complete.
    pub node_gradient: Option<NodeGradient>,
    /// d objective / d ln p, by a factor on all pressures, where wanted and the path is complete.
    pub pressure_derivative: Option<f64>,
    /// Where the nodes come from.
    pub source: Option<BodySource>,
}

/// Element family of a mapped mesh.
pub fn plan_element(choice: ElementChoice) -> PlanElement {
    match choice {
        ElementChoice::Quad4 => PlanElement::Quad4,
        ElementChoice::Auto | ElementChoice::Quad9 => PlanElement::Quad9,
    }
}

/// Meshes an actuator by a plan, or by the one that its own size rule chooses.
pub fn mesh_actuator(
    actuator: &Actuator,
    plan: Option<&MeshPlan>,
    request: &MeshRequest,
) -> Result<MappedMesh, InfeasibleGeometry> {
    match plan {
        Some(plan) => build(actuator, plan),
        None => build(
            actuator,
            &MeshPlan::choose(actuator, plan_element(request.element), request.size())?,
        ),
    }
}

/// Solves a scene.
///
/// # Errors
/// Faults of a mesh file and of what the scene says of its groups; probes outside the solid.
pub fn solve_scene(
    scene: &Scene,
    options: &SceneOptions,
    observer: &mut dyn Observer,
) -> Result<SceneSolution, Faults> {
    let (body, laws, source, scaled) = match &scene.body {
        Body::Actuator(chain) => {
            let built = mesh_actuator(&chain.actuator, options.plan.as_ref(), &scene.mesh);
            match built {
                Ok(mesh) => {
                    let scaled = mesh.scaled_jacobian;
                    let body = mesh.discretisation.clone();
                    (
                        body,
                        chain.materials.clone(),
                        BodySource::Mapped(Box::new(mesh)),
                        Some(scaled),
                    )
                }
                Err(reason) => return Ok(unmeshable(scene, &reason.to_string())),
            }
        }
        Body::MeshFile(file) => {
            let model = gmsh::load(file, scene.actuation.channels(), scene.mesh.element)?;
            let (body, laws) = (model.discretisation.clone(), model.laws.clone());
            (body, laws, BodySource::File(Box::new(model)), None)
        }
    };
    let mut body = body;
    body.obstacles.clone_from(&scene.obstacles);
    let (contact, lowered) = contact_of(scene.contact, scene.contact_activation_mm, &body)?;
    body.contact = contact;
    let probes = probe_points(scene, &body)?;
    let goal = placed_goal(scene);
    let wanted = Wanted {
        gradients_of: goal
            .iter()
            .filter(|_| options.gradient)
            .map(|g| g.measure.clone())
            .collect(),
        stretch_radius: (!options.path_only).then_some(STRETCH_LENGTH_MM),
        wall_gaps: false,
        limit_gradients: false,
        walls: !options.path_only,
        gaps: !options.path_only,
        fields: options.fields,
    };
    let settings = Settings {
        tolerance: scene.relative_residual_force_tolerance,
        control: options.control,
        ..Settings::default()
    };
    let mut analysed = |body: Discretisation| {
        let (cycle, observer) = (&scene.actuation, &mut *observer);
        analyse(body, &laws, cycle, &probes, &settings, &wanted, observer)
    };
    let again = halved_activation(scene.contact, &body);
    let mut analysis = match analysed(body) {
        Ok(analysis) => analysis,
        Err(reason) => return Ok(unmeshable(scene, &reason.to_string())),
    };
    let mut notes = Vec::from_iter(lowered);
    if let Some((body, note)) = again
        && is_stuck_in_contact(&analysis)
        && let Ok(mut second) = analysed(body)
    {
        notes.push(note);
        second.work.add(&analysis.work);
        analysis = second;
    }
    let differentiated = goal
        .as_ref()
        .filter(|_| options.gradient && analysis.end == PathEnd::Complete);
    let node_gradient = differentiated.and_then(|goal| goal_gradient(goal, &analysis));
    let pressure_derivative = differentiated.and_then(|goal| {
        let weights = goal_weights(goal, &analysis);
        analysis.sensitivities.combine_pressure(&weights)
    });
    let mut answer = answer(scene, options, &analysis, &laws, goal.as_ref(), scaled);
    answer.notes.extend(notes);
    Ok(SceneSolution {
        answer,
        node_gradient,
        pressure_derivative,
        body: Some(analysis.system.body),
        fields: analysis.fields,
        source: Some(source),
    })
}

/// Whether a path ended by a failure of ours where surfaces act on each other.
fn is_stuck_in_contact(analysis: &Analysis) -> bool {
    let cancelled = matches!(analysis.end, PathEnd::NotConverged(NotConverged::Cancelled));
    let failed = matches!(analysis.end, PathEnd::NotConverged(_));
    failed && !cancelled && analysis.work.contact_steps > 0
}

/// Interpolation of each probe.
pub fn probe_points(scene: &Scene, body: &Discretisation) -> Result<Vec<ProbePoint>, Faults> {
    let mut faults = Faults::default();
    let mut points = Vec::new();
    for probe in &scene.probes {
        match locate(&body.mesh, probe.at_mm) {
            Some(l) => points.push(ProbePoint::new(&body.mesh, l.block, l.element, l.local)),
            None => faults.add(format!("probes.{}", probe.name), "is not in the solid"),
        }
    }
    faults.check(points)
}

/// The scene's objective with its probes as the analysis has them.
pub fn placed_goal(scene: &Scene) -> Option<Goal<PlacedProbe>> {
    let objective = scene.objective.as_ref()?;
    Some(Goal {
        measure: objective.measure.map_probes(by_name(&scene.probes))?,
        sense: objective.sense,
    })
}

/// d objective / d node position over a complete path.
pub fn goal_gradient(goal: &Goal<PlacedProbe>, analysis: &Analysis) -> Option<NodeGradient> {
    analysis
        .sensitivities
        .combine(&goal_weights(goal, analysis))
}

/// Derivatives of the objective with respect to the numbers of its states.
fn goal_weights(goal: &Goal<PlacedProbe>, analysis: &Analysis) -> Vec<Weight> {
    let (_, slope) = goal.objective(goal.measure.value(&analysis.states));
    let mut weights = goal.measure.weights(&analysis.states);
    for (.., weight) in &mut weights {
        *weight *= slope;
    }
    weights
}

/// First crossing of walls over the path, else the first fold of a corner.
pub fn overlap_report(states: &[Measured]) -> Option<OverlapReport> {
    let found = |fold: bool| {
        states
            .iter()
            .find(|s| s.crossing.is_some_and(|c| c.corner_fold == fold))
    };
    let state = found(false).or_else(|| found(true))?;
    let crossing = state.crossing?;
    Some(OverlapReport {
        leg: state.point.leg,
        fraction: state.point.fraction,
        pressure_kpa: state.point.pressure_kpa.clone(),
        at_mm: crossing.at_mm,
        corner_fold: crossing.corner_fold,
    })
}

fn resolved(scene: &Scene) -> serde_json::Value {
    serde_json::to_value(scene).unwrap_or_default()
}

/// The answer of a shape that cannot be meshed.
fn unmeshable(scene: &Scene, reason: &str) -> SceneSolution {
    SceneSolution {
        answer: SceneAnswer {
            status: SceneStatus::InfeasibleGeometry,
            reason: Some(reason.to_owned()),
            load_fraction_reached: 0.0,
            limit: None,
            unique: true,
            loss_of_uniqueness: None,
            walls_overlap: None,
            path: Vec::new(),
            objective: None,
            enclosed_area_mm2: None,
            self_crossing: false,
            area_sampling_error_mm2: None,
            mesh: MeshAnswer::default(),
            resolved: resolved(scene),
            work: PathWork::default(),
            contact: None,
            left_out: Vec::new(),
            notes: Vec::new(),
        },
        body: None,
        fields: Vec::new(),
        node_gradient: None,
        pressure_derivative: None,
        source: None,
    }
}

fn answer(
    scene: &Scene,
    options: &SceneOptions,
    analysis: &Analysis,
    laws: &[MaterialLaw],
    goal: Option<&Goal<PlacedProbe>>,
    scaled_jacobian: Option<f64>,
) -> SceneAnswer {
    let (status, reason, limit) = match &analysis.end {
        PathEnd::Complete => (SceneStatus::Ok, None, None),
        PathEnd::NoEquilibrium(limit) => (SceneStatus::NoEquilibrium, None, Some(limit.clone())),
        PathEnd::NotConverged(why) => (SceneStatus::NotConverged, Some(why.to_string()), None),
    };
    let complete = status == SceneStatus::Ok;
    let goal = goal.filter(|_| complete);
    let tips = goal
        .and_then(|g| g.measure.tip())
        .map(|p| tip_displacements(&analysis.states, *p));
    SceneAnswer {
        status,
        reason,
        load_fraction_reached: analysis.reached,
        limit,
        unique: analysis.loss.is_none(),
        loss_of_uniqueness: analysis.loss.clone(),
        walls_overlap: overlap_report(&analysis.states),
        path: analysis
            .states
            .iter()
            .map(|s| state_answer(scene, s))
            .collect(),
        objective: goal.map(|g| g.objective(g.measure.value(&analysis.states)).0),
        enclosed_area_mm2: tips.as_deref().map(enclosed_area::area),
        self_crossing: tips.as_deref().is_some_and(enclosed_area::crosses_itself),
        area_sampling_error_mm2: tips
            .as_deref()
            .and_then(|t| enclosed_area::sampling_error(t, scene.actuation.load_steps_per_leg)),
        mesh: mesh_answer(analysis, scaled_jacobian),
        resolved: resolved(scene),
        work: analysis.work,
        contact: contact_answer(scene, &analysis.system.body, &analysis.states),
        left_out: left_out(scene, options, analysis, laws),
        notes: notes::of_ranges(&scene.body, laws, &analysis.states)
            .into_iter()
            .chain(notes::of_corners(&scene.body))
            .collect(),
    }
}

fn state_answer(scene: &Scene, s: &Measured) -> StateAnswer {
    StateAnswer {
        leg: s.point.leg,
        fraction: s.point.fraction,
        pressure_kpa: s.point.pressure_kpa.clone(),
        displacement_mm: scene
            .probes
            .iter()
            .zip(&s.displacement)
            .map(|(p, d)| (p.name.clone(), *d))
            .collect(),
        cavity_area_mm2: s.cavity_area.clone(),
        max_stretch: s.max_stretch,
        max_stretch_raw: s.max_stretch_raw,
        min_gap_mm: s.min_gap,
        negative_pivots: s.negative_pivots,
        residual: s.residual,
        min_jacobian: s.min_jacobian,
        contact: s.contact.as_ref().map(|c| StateContactAnswer {
            least_distance_mm: c.least_distance_mm,
            max_pressure_kpa: 1e3 * c.pressure_mpa,
            energy_n: c.energy,
            obstacle_force_n_per_mm: scene
                .obstacles
                .iter()
                .zip(&c.on_obstacle)
                .map(|(o, f)| (o.name.clone(), *f))
                .collect(),
        }),
    }
}

fn mesh_answer(analysis: &Analysis, scaled_jacobian: Option<f64>) -> MeshAnswer {
    let mesh = &analysis.system.body.mesh;
    let kinds: Vec<&str> = mesh
        .blocks
        .iter()
        .map(|b| match b.kind {
            ElementKind::Quad4 => "quad4",
            ElementKind::Quad9 => "quad9",
            ElementKind::Tri7 => "tri7",
        })
        .collect();
    MeshAnswer {
        element: kinds.join("+"),
        elements: mesh.blocks.iter().map(crate::mesh::ElementBlock::len).sum(),
        dofs: analysis.system.dofs.free(),
        max_size_mm: crate::mesh::quality::longest_edge(mesh),
        scaled_jacobian,
    }
}

fn left_out(
    scene: &Scene,
    options: &SceneOptions,
    analysis: &Analysis,
    laws: &[MaterialLaw],
) -> Vec<LeftOut> {
    let mut out = Vec::new();
    let mut add = |what: &str, why: String| {
        out.push(LeftOut {
            what: what.to_owned(),
            why,
        });
    };
    let gap = analysis
        .states
        .iter()
        .filter_map(|s| s.min_gap)
        .fold(f64::INFINITY, f64::min);
    match scene.contact {
        ContactMode::Off => add("self-contact", "the scene says off".to_owned()),
        ContactMode::On => {}
        ContactMode::Auto if analysis.states.iter().any(|s| s.contact.is_some()) => {}
        ContactMode::Auto if gap.is_finite() => {
            add("self-contact", format!("least gap {gap:.3} mm"));
        }
        ContactMode::Auto => add("self-contact", "no walls face each other".to_owned()),
    }
    for channel in 0..scene.actuation.channels() {
        if scene
            .actuation
            .rows_kpa
            .iter()
            .all(|row| row[channel] == 0.0)
        {
            add(
                &format!("load of channel {channel}"),
                "it stays at zero".to_owned(),
            );
        }
    }
    if laws.windows(2).all(|w| w[0] == w[1]) && laws.len() > 1 {
        add(
            "materials by unit",
            "all units have the same law".to_owned(),
        );
    }
    if scene.objective.is_none() {
        add("objective", "the scene names none".to_owned());
    }
    if !options.gradient {
        let why = "no gradient is asked for";
        add("derivatives and the factors they need", why.to_owned());
    }
    if !options.fields {
        let why = "no file and no picture is asked for";
        add("displacement fields", why.to_owned());
    }
    if options.path_only {
        let why = "only the path is asked for";
        add("stretches, gaps and crossings of walls", why.to_owned());
    }
    out
}
