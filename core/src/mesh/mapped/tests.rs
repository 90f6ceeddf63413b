mod derivatives;
mod meshes;
mod plans;
mod rounded;
mod shapes;

use super::*;

fn mesh_of(actuator: &Actuator, element: PlanElement) -> MappedMesh {
    let plan = MeshPlan::choose(actuator, element, None).unwrap();
    build(actuator, &plan).unwrap()
}
