//! The page in a real Chromium, against a real server: one file per subject.

mod hosts;
mod lobby;
mod needs;
mod network;
mod particles;
mod pictures;
mod playing;
mod replay;
#[path = "../particles/streams.rs"]
mod streams;
mod trouble;

use jostle_tests::runner::{self, Case};
use std::process::ExitCode;

/// In the order in which one would try things by hand.
const CASES: &[Case] = &[
    Case {
        name: "a_key_in_one_page_moves_the_hero_seen_in_another",
        run: |stage| Box::pin(playing::a_key_in_one_page_moves_the_hero_seen_in_another(stage)),
    },
    Case {
        name: "two_tabs_of_one_visitor_are_two_players",
        run: |stage| Box::pin(playing::two_tabs_of_one_visitor_are_two_players(stage)),
    },
    Case {
        name: "a_clicked_pack_reaches_the_hero_and_bursts_into_saturated_particles",
        run: |stage| Box::pin(playing::a_pack_reaches_the_hero_and_bursts(stage)),
    },
    Case {
        name: "impulse_z_drops_x_grabs_c_shakes_v_clears",
        run: |stage| Box::pin(playing::impulse_tools(stage)),
    },
    Case {
        name: "bounds_h_m_p_select_and_the_mouse_drags",
        run: |stage| Box::pin(playing::bounds_selection(stage)),
    },
    Case {
        name: "bounds_are_red_where_the_selected_body_touches",
        run: |stage| Box::pin(playing::bounds_colors(stage)),
    },
    Case {
        name: "particles_z_sprays_and_the_spray_dies_out",
        run: |stage| Box::pin(playing::particles_spray(stage)),
    },
    Case {
        name: "a_scene_without_particles_loads_nothing_for_them",
        run: |stage| Box::pin(needs::a_scene_without_particles_loads_nothing_for_them(stage)),
    },
    Case {
        name: "another_room_adds_what_is_missing",
        run: |stage| Box::pin(needs::another_room_adds_what_is_missing(stage)),
    },
    Case {
        name: "a_key_moves_the_hero_before_the_server_says_so",
        run: |stage| Box::pin(network::a_key_moves_the_hero_before_the_server_says_so(stage)),
    },
    Case {
        name: "without_prediction_the_hero_waits_for_the_server",
        run: |stage| Box::pin(network::without_prediction_the_hero_waits(stage)),
    },
    Case {
        name: "f4_shows_the_network_and_simulates_a_bad_one_visibly",
        run: |stage| Box::pin(network::the_panel_simulates_a_bad_network(stage)),
    },
    Case {
        name: "a_lost_socket_gives_the_same_seat_back",
        run: |stage| Box::pin(trouble::a_lost_socket_gives_the_same_seat_back(stage)),
    },
    Case {
        name: "a_restarted_server_is_found_again",
        run: |stage| Box::pin(trouble::a_restarted_server_is_found_again(stage)),
    },
    Case {
        name: "a_lost_webgl_context_is_drawn_again",
        run: |stage| Box::pin(trouble::a_lost_webgl_context_is_drawn_again(stage)),
    },
    Case {
        name: "lost_focus_releases_keys",
        run: |stage| Box::pin(trouble::lost_focus_releases_keys(stage)),
    },
    Case {
        name: "a_wrong_room_is_explained",
        run: |stage| Box::pin(trouble::a_wrong_room_is_explained(stage)),
    },
    Case {
        name: "a_full_room_is_explained_and_goes_on",
        run: |stage| Box::pin(trouble::a_full_room_is_explained_and_goes_on(stage)),
    },
    Case {
        name: "the_lack_of_webgl2_is_explained",
        run: |stage| Box::pin(trouble::the_lack_of_webgl2_is_explained(stage)),
    },
    Case {
        name: "the_lobby_opens_a_room_and_copies_its_link",
        run: |stage| Box::pin(lobby::the_lobby_opens_a_room_and_copies_its_link(stage)),
    },
    Case {
        name: "play_joins_the_room_with_players",
        run: |stage| Box::pin(lobby::play_joins_the_room_with_players(stage)),
    },
    Case {
        name: "the_help_takes_the_focus_and_gives_it_back",
        run: |stage| Box::pin(lobby::the_help_takes_the_focus_and_gives_it_back(stage)),
    },
    Case {
        name: "a_phone_has_a_stick_and_nothing_scrolls",
        run: |stage| Box::pin(lobby::a_phone_has_a_stick_and_nothing_scrolls(stage)),
    },
    Case {
        name: "a_host_opens_a_private_room_and_removes_a_player",
        run: |stage| Box::pin(hosts::a_host_opens_a_private_room_and_removes_a_player(stage)),
    },
    Case {
        name: "a_host_closes_the_room",
        run: |stage| Box::pin(hosts::a_host_closes_the_room(stage)),
    },
    Case {
        name: "frozen_scenes_look_as_they_did",
        run: |stage| Box::pin(pictures::frozen_scenes_look_as_they_did(stage)),
    },
    Case {
        name: "the_page_plays_a_scene_bit_for_bit_as_the_native_program_does",
        run: |stage| Box::pin(pictures::the_page_plays_bit_for_bit(stage)),
    },
    Case {
        name: "the_page_has_the_particles_of_the_game",
        run: |stage| Box::pin(particles::the_page_has_the_particles_of_the_game(stage)),
    },
    Case {
        name: "a_dropped_replay_plays_and_every_tick_is_equal",
        run: |stage| Box::pin(replay::a_dropped_replay_plays_and_every_tick_is_equal(stage)),
    },
    Case {
        name: "the_page_plays_the_golden_replays",
        run: |stage| Box::pin(replay::the_page_plays_the_golden_replays(stage)),
    },
    Case {
        name: "a_wrong_hash_turns_the_mark_of_a_replay_red",
        run: |stage| Box::pin(replay::a_wrong_hash_turns_the_mark_red(stage)),
    },
    Case {
        name: "bad_replay_files_are_explained",
        run: |stage| Box::pin(replay::bad_files_are_explained(stage)),
    },
    Case {
        name: "a_server_lists_its_replays_and_links_to_them",
        run: |stage| Box::pin(replay::a_server_lists_its_replays_and_links_to_them(stage)),
    },
    Case {
        name: "a_paused_replay_looks_as_it_does_natively",
        run: |stage| Box::pin(replay::a_paused_replay_looks_as_it_does_natively(stage)),
    },
];

fn main() -> ExitCode {
    runner::main(CASES)
}
