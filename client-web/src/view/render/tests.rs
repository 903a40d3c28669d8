//! What a scene costs on the device; `jostle-picture` draws.

use jostle_game::Scene;
use jostle_game::scene::Plan;

#[test]
fn the_plan_of_a_scene_decides_which_resources_are_created() {
    for scene in Scene::built_in() {
        let needed = Plan::of(&scene).features.particles;
        let lacks =
            ["bounds", "impulse", "pile", "roundup", "lamp", "bounce", "planets", "listing"];
        let lacks = lacks.contains(&scene.name.as_str());
        assert_eq!(needed, !lacks, "{}", scene.name);
    }
}
