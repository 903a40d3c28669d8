//! Tests of the page in a real Chromium against a real server, with one file per subject.

mod alone;
mod editor;
mod fleet;
mod framed;
#[path = "../fleet/games.rs"]
mod games;
mod hands;
mod hosts;
mod layout;
mod lobby;
mod needs;
mod network;
#[path = "../fleet/node.rs"]
mod node;
mod particles;
mod pictures;
#[path = "../fleet/player.rs"]
mod player;
mod playing;
mod records;
mod replay;
mod rounds;
mod sharing;
mod sound;
#[path = "../particles/streams.rs"]
mod streams;
mod trouble;
mod watching;

use jostle_tests::runner::{self, Case};
use std::process::ExitCode;

/// All cases, in the order in which a person would try things.
fn cases() -> Vec<Case> {
    let mut cases = vec![
        Case::new(
            "a_key_in_one_page_moves_the_hero_seen_in_another",
            playing::a_key_in_one_page_moves_the_hero_seen_in_another,
        ),
        Case::new(
            "two_tabs_of_one_visitor_are_two_players",
            playing::two_tabs_of_one_visitor_are_two_players,
        ),
        Case::new(
            "a_clicked_pack_reaches_the_hero_and_bursts_into_saturated_particles",
            playing::a_pack_reaches_the_hero_and_bursts,
        ),
        Case::new("impulse_z_drops_x_grabs_c_shakes_v_clears", playing::impulse_tools),
        Case::new("bounds_h_m_p_select_and_the_mouse_drags", playing::bounds_selection),
        Case::new("bounds_shows_the_selected_shape_on_a_touch_screen", playing::bounds_by_touch),
        Case::new("bounds_are_red_where_the_selected_body_touches", playing::bounds_colors),
        Case::new("particles_z_sprays_and_the_spray_dies_out", playing::particles_spray),
        Case::new(
            "a_scene_without_particles_loads_nothing_for_them",
            needs::a_scene_without_particles_loads_nothing_for_them,
        ),
        Case::new("another_room_adds_what_is_missing", needs::another_room_adds_what_is_missing),
        Case::new(
            "a_round_is_counted_down_played_and_won",
            rounds::a_round_is_counted_down_played_and_won,
        ),
        Case::new(
            "the_end_of_a_round_is_watched_once_more",
            rounds::the_end_of_a_round_is_watched_once_more,
        ),
        Case::new(
            "the_next_round_begins_when_both_want_it",
            rounds::the_next_round_begins_when_both_want_it,
        ),
        Case::new(
            "a_key_moves_the_hero_before_the_server_says_so",
            network::a_key_moves_the_hero_before_the_server_says_so,
        ),
        Case::new(
            "without_prediction_the_hero_waits_for_the_server",
            network::without_prediction_the_hero_waits,
        ),
        Case::new(
            "f4_shows_the_network_and_simulates_a_bad_one_visibly",
            network::the_panel_simulates_a_bad_network,
        ),
        Case::new(
            "a_lost_socket_gives_the_same_seat_back",
            trouble::a_lost_socket_gives_the_same_seat_back,
        ),
        Case::new(
            "back_and_forward_keep_the_seat_on_a_server",
            trouble::back_and_forward_keep_the_seat,
        ),
        Case::new(
            "a_page_below_a_path_says_that_it_needs_the_root",
            trouble::a_page_below_a_path_says_that_it_needs_the_root,
        ),
        Case::new(
            "a_game_is_played_where_no_websocket_opens",
            trouble::a_game_is_played_where_no_websocket_opens,
        ),
        Case::new("a_restarted_server_is_found_again", trouble::a_restarted_server_is_found_again),
        Case::new("a_room_outlives_its_server", trouble::a_room_outlives_its_server),
        Case::new(
            "a_page_follows_its_room_to_another_server",
            fleet::a_page_follows_its_room_to_another_server,
        )
        .alone(),
        Case::new(
            "a_room_is_played_in_the_frame_of_another_site",
            framed::a_room_is_played_in_the_frame_of_another_site,
        ),
        Case::new(
            "a_frame_that_nobody_allowed_stays_empty",
            framed::a_frame_that_nobody_allowed_stays_empty,
        ),
        Case::new(
            "a_lost_webgl_context_is_drawn_again",
            trouble::a_lost_webgl_context_is_drawn_again,
        ),
        Case::new("lost_focus_releases_keys", trouble::lost_focus_releases_keys),
        Case::new("a_wrong_room_is_explained", trouble::a_wrong_room_is_explained),
        Case::new("the_lack_of_webgl2_is_explained", trouble::the_lack_of_webgl2_is_explained),
        Case::new(
            "the_lobby_opens_a_room_and_copies_its_link",
            lobby::the_lobby_opens_a_room_and_copies_its_link,
        ),
        Case::new("the_lobby_is_downloaded_once", lobby::the_lobby_is_downloaded_once),
        Case::new("play_begins_a_game_with_bots", rounds::play_begins_a_game_with_bots),
        Case::new("play_joins_the_room_with_players", lobby::play_joins_the_room_with_players),
        Case::new(
            "the_help_takes_the_focus_and_gives_it_back",
            lobby::the_help_takes_the_focus_and_gives_it_back,
        ),
        Case::new(
            "a_phone_has_a_stick_and_nothing_scrolls",
            lobby::a_phone_has_a_stick_and_nothing_scrolls,
        ),
        Case::new(
            "a_host_opens_a_private_room_and_removes_a_player",
            hosts::a_host_opens_a_private_room_and_removes_a_player,
        ),
        Case::new("a_host_closes_the_room", hosts::a_host_closes_the_room),
        Case::new(
            "sound_begins_with_play_and_rests_while_hidden",
            sound::sound_begins_with_play_and_rests_while_hidden,
        ),
        Case::new("volume_and_captions_are_remembered", sound::volume_and_captions_are_remembered),
        Case::new("a_page_without_sound_says_so", sound::a_page_without_sound_says_so),
        Case::new("a_golden_minute_sounds_as_it_did", sound::a_golden_minute_sounds_as_it_did),
    ];
    cases.extend(editor_cases());
    cases.extend(sharing_cases());
    cases.extend(pictures::cases());
    cases.extend([
        Case::new(
            "the_page_plays_a_scene_bit_for_bit_as_the_native_program_does",
            pictures::the_page_plays_bit_for_bit,
        ),
        Case::new(
            "the_page_has_the_particles_of_the_game",
            particles::the_page_has_the_particles_of_the_game,
        ),
        Case::new(
            "a_dropped_replay_plays_and_every_tick_is_equal",
            replay::a_dropped_replay_plays_and_every_tick_is_equal,
        ),
    ]);
    cases.extend(alone::cases());
    cases.extend(records::cases());
    cases.extend(layout::cases());
    cases.extend(hands::cases());
    cases.extend(watching::cases());
    cases.extend([
        Case::new("the_page_plays_golden_replays", replay::the_page_plays_golden_replays),
        Case::new(
            "a_server_lists_its_replays_and_links_to_them",
            replay::a_server_lists_its_replays_and_links_to_them,
        ),
        Case::new("a_paused_replay_looks_as_it_did", replay::a_paused_replay_looks_as_it_did),
    ]);
    cases
}

fn editor_cases() -> [Case; 12] {
    [
        Case::new(
            "a_scene_is_built_from_nothing_played_undone_and_shared",
            editor::a_scene_is_built_from_nothing_played_undone_and_shared,
        ),
        Case::new(
            "a_shipped_scene_keeps_its_comments_in_the_editor",
            editor::a_shipped_scene_keeps_its_comments,
        ),
        Case::new(
            "errors_of_a_scene_are_shown_at_their_place",
            editor::errors_are_shown_at_their_place,
        ),
        Case::new("a_game_is_built_by_clicks", editor::a_game_is_built_by_clicks),
        Case::new("a_scene_is_built_by_touch", editor::a_scene_is_built_by_touch),
        Case::new("the_form_is_that_of_the_scene", editor::the_form_is_that_of_the_scene),
        Case::new(
            "the_editor_fits_a_phone_on_its_side",
            editor::the_editor_fits_a_phone_on_its_side,
        ),
        Case::new("a_scene_is_built_by_keys", editor::a_scene_is_built_by_keys),
        Case::new("a_form_writes_into_the_text_of_a_scene", editor::a_form_writes_into_the_text),
        Case::new("a_game_is_made_by_choosing", editor::a_game_is_made_by_choosing),
        Case::new("a_scene_is_dropped_and_saved_as_a_file", editor::a_scene_is_a_file_too),
        Case::new("two_tabs_keep_a_draft_each", editor::two_tabs_keep_a_draft_each),
    ]
}

/// Cases on rooms, codes and links of scenes.
fn sharing_cases() -> [Case; 4] {
    [
        Case::new(
            "a_room_with_the_edited_scene_is_opened",
            sharing::a_room_with_the_edited_scene_is_opened,
        ),
        Case::new(
            "a_scene_that_the_server_refuses_shows_why_at_its_place",
            sharing::a_scene_that_the_server_refuses_shows_why_at_its_place,
        ),
        Case::new(
            "the_code_of_an_edited_scene_is_its_link",
            sharing::the_code_of_an_edited_scene_is_its_link,
        ),
        Case::new("a_link_with_an_error_leads_to_it", sharing::a_link_with_an_error_leads_to_it),
    ]
}

fn main() -> ExitCode {
    runner::main(&cases())
}
