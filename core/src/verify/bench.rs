//! Lines of a verification: what was found, what it is held against, and whether that is near enough.

use serde::Serialize;

use crate::equilibrium::{LimitKind, Observer};
use crate::mesh::ElementKind;

/// One quantity of one problem on one element.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Line {
    /// The problem.
    pub problem: &'static str,
    /// The element.
    pub element: ElementKind,
    /// What is compared.
    pub quantity: String,
    /// What was found; `None` where the problem was not solved.
    pub value: Option<f64>,
    /// What is right.
    pub expected: Option<f64>,
    /// Their difference over the quantity's scale.
    pub error: Option<f64>,
    /// The largest error that passes.
    pub bound: Option<f64>,
    /// Observed order of three nested meshes.
    pub order: Option<f64>,
    /// The smallest order that passes.
    pub least_order: Option<f64>,
    /// Whether error and order are within their bounds.
    pub passed: bool,
    /// Why there is no value.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub reason: Option<String>,
    /// CPU seconds since the line before.
    pub cpu_s: f64,
}

/// The caller's clock.
pub trait CpuClock: Observer {
    /// CPU seconds of this thread or process.
    fn cpu_s(&self) -> f64;
}

/// What a line compares.
pub(super) struct Checked {
    pub quantity: String,
    pub value: f64,
    pub expected: f64,
    /// What the difference is divided by.
    pub scale: f64,
    pub bound: f64,
    /// Values on three nested meshes, coarsest first, and the least order that passes. The order is that of the values'
    /// differences: of the mesh alone, whatever K/mu leaves.
    pub orders: Option<([f64; 3], f64)>,
}

/// Collects the lines of one problem on one element.
pub(super) struct Bench<'a> {
    clock: &'a mut dyn CpuClock,
    problem: &'static str,
    element: ElementKind,
    /// Bounds are divided by this.
    tighten: f64,
    since: f64,
    lines: Vec<Line>,
}

impl<'a> Bench<'a> {
    pub(super) fn new(
        clock: &'a mut dyn CpuClock,
        problem: &'static str,
        element: ElementKind,
        tighten: f64,
    ) -> Self {
        let since = clock.cpu_s();
        Self {
            clock,
            problem,
            element,
            tighten,
            since,
            lines: Vec::new(),
        }
    }

    /// For solves.
    pub(super) fn observer(&mut self) -> &mut dyn Observer {
        self.clock
    }

    /// Notes a comparison.
    pub(super) fn check(&mut self, checked: Checked) {
        let error = ((checked.value - checked.expected) / checked.scale).abs();
        let bound = checked.bound / self.tighten;
        let order = checked
            .orders
            .map(|([coarse, mid, fine], _)| ((mid - coarse) / (fine - mid)).abs().log2());
        let least_order = checked.orders.map(|(_, least)| least);
        // Not a number fails as well.
        let converges = match (order, least_order) {
            (Some(order), Some(least)) => order >= least,
            _ => true,
        };
        self.push(Line {
            problem: self.problem,
            element: self.element,
            quantity: checked.quantity,
            value: finite(checked.value),
            expected: finite(checked.expected),
            error: finite(error),
            bound: finite(bound),
            order: order.and_then(finite),
            least_order,
            passed: error <= bound && converges,
            reason: None,
            cpu_s: 0.0,
        });
    }

    /// Notes that a problem has no solution.
    pub(super) fn unsolved(&mut self, quantity: &str, reason: &dyn std::fmt::Display) {
        self.push(Line {
            problem: self.problem,
            element: self.element,
            quantity: quantity.to_owned(),
            value: None,
            expected: None,
            error: None,
            bound: None,
            order: None,
            least_order: None,
            passed: false,
            reason: Some(reason.to_string()),
            cpu_s: 0.0,
        });
    }

    fn push(&mut self, mut line: Line) {
        let now = self.clock.cpu_s();
        line.cpu_s = now - self.since;
        self.since = now;
        self.lines.push(line);
    }

    pub(super) fn finish(self) -> Vec<Line> {
        self.lines
    }
}

fn finite(value: f64) -> Option<f64> {
    value.is_finite().then_some(value)
}

/// Name of a limit's kind in documents.
pub(super) fn kind_name(kind: LimitKind) -> String {
    serde_name(&kind)
}

/// Name of a plain variant in documents.
pub(super) fn serde_name(value: &impl Serialize) -> String {
    let value = serde_json::to_value(value).unwrap_or_default();
    value.as_str().unwrap_or_default().to_owned()
}
