//! The player-visible state of a scene's rules. It is coded as a whole whenever it changes. That is rare, because its
//! clock is a tick that stays the same throughout a phase.

use super::sections::bit;
use crate::bits::{fold, unfold};
use crate::error::{DecodeError, check};
use crate::ids::{read_seat, write_seat};
use crate::limits::BODIES_MAX;
use crate::wire::{Gaps, Reader, Writer};
use jostle_game::scene::{POINTS_MAX, SIGNALS_MAX, TEAMS_MAX, ZONES_MAX};
use jostle_game::{
    OrderProgress, RoundInfo, RoundPhase, RoundPlayer, SEATS_MAX, Side, SideInfo, SlingInfo, Taking,
};

/// Length of the shortest side and of the shortest player, bytes.
const SIDE_BYTES_MIN: usize = 2;
const PLAYER_BYTES_MIN: usize = 4;
/// Length of the shortest side that is taking a zone and of the shortest progress in an order, bytes.
const TAKING_BYTES_MIN: usize = 4;
const ORDER_BYTES_MIN: usize = 3;
/// Flags in the phase byte: a sling exists, its ball is in flight, bodies are cracked, zones are being taken or orders
/// are in progress, and some zones are inactive.
const SLING: u8 = 1 << 2;
const FLYING: u8 = 1 << 3;
const CRACKED: u8 = 1 << 4;
const PHASE: u8 = SLING - 1;
const PROGRESS: u8 = 1 << 5;
const RESTING: u8 = 1 << 6;
const TAG_ALL: u8 = (1 << 7) - 1;
/// Flags in the byte for a player's team.
const STUNNED: u8 = 1;
const GOES_ON: u8 = 2;
const TEAM_SHIFT: u8 = 2;
const NO_SIDE: u8 = 0;
const TEAM: u8 = 1;
const PLAYER: u8 = 2;

/// Writes a round, if there is one.
pub fn write(writer: &mut Writer, round: Option<&RoundInfo>) {
    writer.option(round, write_round);
}

fn write_round(writer: &mut Writer, round: &RoundInfo) {
    let is_flying = round.sling.is_some_and(|sling| sling.is_flying);
    let is_cracked = !round.cracked.is_empty();
    let has_sling = bit(round.sling.is_some(), SLING) | bit(is_flying, FLYING);
    let has_progress = !(round.takings.is_empty() && round.orders.is_empty());
    let extras =
        bit(is_cracked, CRACKED) | bit(has_progress, PROGRESS) | bit(round.resting != 0, RESTING);
    writer.byte(round.phase as u8 | has_sling | extras);
    writer.leb32(round.since);
    writer.count(round.teams.len());
    round.teams.iter().for_each(|team| write_side_info(writer, team));
    writer.count(round.players.len());
    for player in &round.players {
        write_seat(writer, player.seat);
        let flags = bit(player.is_stunned, STUNNED) | bit(player.goes_on, GOES_ON);
        writer.byte(player.team.map_or(0, |team| team + 1) << TEAM_SHIFT | flags);
        write_side_info(writer, &player.side);
    }
    writer.count(round.winners.len());
    round.winners.iter().for_each(|&side| write_side(writer, Some(side)));
    writer.count(round.holders.len());
    round.holders.iter().for_each(|&side| write_side(writer, side));
    write_zones(writer, round.zones);
    if round.resting != 0 {
        write_zones(writer, round.resting);
    }
    if let Some(sling) = round.sling {
        writer.byte(sling.shots);
    }
    if is_cracked {
        writer.count(round.cracked.len());
        let mut gaps = Gaps::default();
        round.cracked.iter().for_each(|&index| gaps.write(writer, index));
    }
    if has_progress {
        write_progress(writer, round);
    }
}

fn write_zones(writer: &mut Writer, zones: u64) {
    writer.leb32(zones as u32);
    writer.leb32((zones >> 32) as u32);
}

fn read_zones(reader: &mut Reader) -> Result<u64, DecodeError> {
    let (low, high) = (reader.leb32("zones")?, reader.leb32("zones")?);
    Ok(u64::from(high) << 32 | u64::from(low))
}

fn write_progress(writer: &mut Writer, round: &RoundInfo) {
    writer.count(round.takings.len());
    for taking in &round.takings {
        writer.byte(taking.zone);
        write_side(writer, Some(taking.side));
        writer.leb32(taking.since);
    }
    writer.count(round.orders.len());
    for order in &round.orders {
        writer.byte(order.signal);
        write_side(writer, order.side);
        writer.byte(order.steps);
    }
}

fn write_side_info(writer: &mut Writer, side: &SideInfo) {
    writer.zigzag(side.score);
    writer.leb32(fold(side.lives) << 1 | u32::from(side.is_in));
}

fn write_side(writer: &mut Writer, side: Option<Side>) {
    match side {
        None => writer.byte(NO_SIDE),
        Some(Side::Team(team)) => {
            writer.byte(TEAM);
            writer.byte(team);
        }
        Some(Side::Player(seat)) => {
            writer.byte(PLAYER);
            write_seat(writer, seat);
        }
    }
}

/// Reads the output of [`write`].
pub fn read(reader: &mut Reader) -> Result<Option<RoundInfo>, DecodeError> {
    reader.option("round", read_round)
}

fn read_round(reader: &mut Reader) -> Result<RoundInfo, DecodeError> {
    let tag = reader.byte("phase of the round")?;
    check(tag & !TAG_ALL == 0, "phase of the round")?;
    let phase = RoundPhase::ALL[usize::from(tag & PHASE)];
    let since = reader.leb32("start of the phase")?;
    let mut teams = Vec::new();
    for _ in 0..reader.count(TEAMS_MAX, SIDE_BYTES_MIN, "teams")? {
        teams.push(read_side_info(reader)?);
    }
    let mut players: Vec<RoundPlayer> = Vec::new();
    for _ in 0..reader.count(SEATS_MAX, PLAYER_BYTES_MIN, "players of the round")? {
        let player = read_player(reader, teams.len())?;
        let ordered = players.last().is_none_or(|last| last.seat < player.seat);
        check(ordered, "players of the round")?;
        players.push(player);
    }
    let mut winners = Vec::new();
    for _ in 0..reader.count(SEATS_MAX, 1, "winners")? {
        winners.push(read_some_side(reader, teams.len(), "winner")?);
    }
    let mut holders = Vec::new();
    for _ in 0..reader.count(ZONES_MAX, 1, "holders")? {
        holders.push(read_side(reader, teams.len())?);
    }
    let zones = read_zones(reader)?;
    let resting = if tag & RESTING != 0 { read_zones(reader)? } else { 0 };
    let is_flying = tag & FLYING != 0;
    check(!is_flying || tag & SLING != 0, "phase of the round")?;
    let mut sling = None;
    if tag & SLING != 0 {
        sling = Some(SlingInfo { shots: reader.byte("shots")?, is_flying });
    }
    let mut cracked = Vec::new();
    if tag & CRACKED != 0 {
        let mut gaps = Gaps::default();
        for _ in 0..reader.some_count(BODIES_MAX, 1, "cracked bodies")? {
            cracked.push(gaps.read(reader, BODIES_MAX, "cracked body")?);
        }
    }
    let (mut takings, mut orders) = (Vec::new(), Vec::new());
    if tag & PROGRESS != 0 {
        takings = read_takings(reader, teams.len())?;
        orders = read_orders(reader, teams.len())?;
    }
    let round = RoundInfo {
        phase,
        since,
        teams,
        players,
        winners,
        holders,
        zones,
        resting,
        takings,
        orders,
        sling,
        cracked,
    };
    Ok(round)
}

fn read_takings(reader: &mut Reader, teams: usize) -> Result<Vec<Taking>, DecodeError> {
    let mut takings = Vec::new();
    for _ in 0..reader.count(ZONES_MAX, TAKING_BYTES_MIN, "zones that are taken")? {
        let zone = reader.byte("zone")?;
        check(usize::from(zone) < ZONES_MAX, "zone")?;
        let side = read_some_side(reader, teams, "side that takes a zone")?;
        takings.push(Taking { zone, side, since: reader.leb32("start of a taking")? });
    }
    Ok(takings)
}

fn read_orders(reader: &mut Reader, teams: usize) -> Result<Vec<OrderProgress>, DecodeError> {
    let mut orders = Vec::new();
    for _ in 0..reader.count(SIGNALS_MAX * SEATS_MAX, ORDER_BYTES_MIN, "orders")? {
        let signal = reader.byte("signal")?;
        check(usize::from(signal) < SIGNALS_MAX, "signal")?;
        let side = read_side(reader, teams)?;
        orders.push(OrderProgress { signal, side, steps: reader.byte("steps")? });
    }
    Ok(orders)
}

fn read_player(reader: &mut Reader, teams: usize) -> Result<RoundPlayer, DecodeError> {
    let seat = read_seat(reader)?;
    let byte = reader.byte("team")?;
    let team = (byte >> TEAM_SHIFT).checked_sub(1);
    check(team.is_none_or(|team| usize::from(team) < teams), "team")?;
    let (is_stunned, goes_on) = (byte & STUNNED != 0, byte & GOES_ON != 0);
    Ok(RoundPlayer { seat, team, side: read_side_info(reader)?, is_stunned, goes_on })
}

fn read_side_info(reader: &mut Reader) -> Result<SideInfo, DecodeError> {
    let score = reader.zigzag("score")?;
    let word = reader.leb32("lives")?;
    let lives = unfold(word >> 1);
    let fits = |points: i32| (-POINTS_MAX..=POINTS_MAX).contains(&points);
    check(fits(score) && fits(lives), "score")?;
    Ok(SideInfo { score, lives, is_in: word & 1 == 1 })
}

fn read_some_side(
    reader: &mut Reader,
    teams: usize,
    field: &'static str,
) -> Result<Side, DecodeError> {
    read_side(reader, teams)?.ok_or(DecodeError::OutOfRange { field })
}

fn read_side(reader: &mut Reader, teams: usize) -> Result<Option<Side>, DecodeError> {
    match reader.byte("side")? {
        NO_SIDE => Ok(None),
        TEAM => {
            let team = reader.byte("team")?;
            check(usize::from(team) < teams, "team")?;
            Ok(Some(Side::Team(team)))
        }
        PLAYER => Ok(Some(Side::Player(read_seat(reader)?))),
        _ => Err(DecodeError::OutOfRange { field: "side" }),
    }
}
