//! Tests that a game which exceeds its budget ends before the tick in question is played.

use super::*;
use jostle_sim::StepBudget;

#[test]
fn a_tick_over_the_budget_is_not_played_and_none_after_it() {
    let text = "title = \"Heap\"\nsize = [100, 100]\ngroups = [\"block\"]\npairs = [[\"block\", \"block\"]]\n\
                [[layouts]]\nkind = \"block\"\ncount = 100\nradius = 10\narea = [[49, 49], [51, 51]]\n\
                exact = true\ngrid = [10, 10]\n";
    let mut scene = Scene::parse("heap.toml", text).unwrap_or_else(|error| panic!("{error}"));
    scene.world.budget = StepBudget { pairs: 1000, ..StepBudget::UNLIMITED };
    let mut game = Game::new(Arc::new(scene), 1);
    game.join(Seat(0));
    for _ in 0..2 {
        game.tick(&[]);
        assert!(game.is_over_budget());
        assert_eq!((game.tick_count(), game.events().len()), (0, 0));
    }
}
