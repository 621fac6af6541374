use super::*;
use crate::Position;

const LEARNT: [f64; 4] = [50.0, -20.0, 0.0, 7.0];

/// Reading for one newton at `x`, 0 to 1.
fn influence(x: f64) -> [f64; 4] {
    [40.0 * (1.0 - x), 40.0 * x, 60.0 * x * (1.0 - x), 25.0 * (1.0 - x * x)]
}

/// Least squares for noise of 1 count.
fn locate(reading: &[f64]) -> Estimate {
    let d: [f64; 4] = core::array::from_fn(|c| reading[c] - LEARNT[c]);
    let square: f64 = d.iter().map(|d| d * d).sum();
    let misfit = |x: f64| {
        let f = influence(x);
        let (fd, ff) = f.iter().zip(&d).fold((0.0, 0.0), |(fd, ff), (f, d)| (fd + f * d, ff + f * f));
        square - fd.max(0.0) * fd.max(0.0) / ff
    };
    let places = (0..=200).map(|i| f64::from(i) / 200.0);
    let x = places.min_by(|a, b| misfit(*a).total_cmp(&misfit(*b))).unwrap();
    let status = match misfit(x) {
        _ if square < 20.0 => Status::NoContact,
        misfit if misfit < 15.0 => Status::Located,
        _ => Status::OutsideModel,
    };
    Estimate::of_position(Position::along(x), status)
}

fn reading(number: u32, moved: [f64; 4], force: f64, x: f64) -> [f64; 4] {
    let f = influence(x);
    core::array::from_fn(|c| {
        let phase = (number * (3 + 2 * c as u32)) % 101;
        let noise = 1.7 * (f64::from(phase) / 50.0 - 1.0);
        LEARNT[c] + moved[c] + force * f[c] + noise
    })
}

const MOVED: [f64; 4] = [-30.0, 12.0, 45.0, 20.0];

fn follow(tare: &mut Tare<[f64; 4]>, reading: [f64; 4]) -> Estimate {
    let mut tared = [0.0; 4];
    let estimate = tare.locate_and_update(&reading, &mut tared, locate).unwrap();
    assert!((tared[0] - reading[0]).abs() < 200.0);
    estimate
}

fn follow_many(tare: &mut Tare<[f64; 4]>, numbers: core::ops::Range<u32>, (force, x): (f64, f64)) {
    for number in numbers {
        follow(tare, reading(number, MOVED, force, x));
    }
}

fn is_right(tare: &Tare<[f64; 4]>, moved: [f64; 4]) -> bool {
    let expected = LEARNT.iter().zip(moved).map(|(learnt, moved)| learnt + moved);
    tare.baseline().iter().zip(expected).all(|(found, expected)| (found - expected).abs() < 1.0)
}

#[test]
fn forgets_over_seconds_where_readings_have_times() {
    for (rate_hz, readings) in [(10.0, 100), (100.0, 1000), (1000.0, 10_000), (0.5, 20)] {
        let mut tare = Tare::new(LEARNT).unwrap();
        for i in 0..=200 {
            tare.note_time(5.0 + f64::from(i) / rate_hz);
        }
        assert!(tare.time_constant.abs_diff(readings) <= 1, "{rate_hz} Hz: {}", tare.time_constant);
    }
    let mut tare = Tare::new(LEARNT).unwrap();
    for time_s in [0.0, f64::NAN, 1.0, f64::INFINITY, 0.5, 0.5, -1.0, 1e308, f64::MAX] {
        tare.note_time(time_s);
    }
    assert!(tare.time_constant >= Tare::<[f64; 4]>::SETTLED);
}

#[test]
fn follows_a_drift_of_a_minute_at_ten_readings_a_second() {
    // Largest error of the baseline in ten minutes, in counts.
    let worst_error = |has_times: bool| {
        let mut tare = Tare::new(LEARNT).unwrap();
        (0..6000).fold(0.0, |worst: f64, i| {
            let time_s = f64::from(i) / 10.0;
            let moved = 2.0 * libm::sin(core::f64::consts::TAU * time_s / 60.0);
            if has_times {
                tare.note_time(time_s);
            }
            follow(&mut tare, reading(i, [moved; 4], 0.0, 0.0));
            let error = (tare.baseline()[0] - LEARNT[0] - moved).abs();
            if i < 1000 { worst } else { worst.max(error) }
        })
    };
    let (timed, counted) = (worst_error(true), worst_error(false));
    assert!(timed < 1.0 && counted > 1.5, "{timed} {counted}");
}

#[test]
fn the_latest_untouched_reading_is_the_zero() {
    let mut tare = Tare::new(LEARNT).unwrap().with_last_zero();
    for i in 0..40 {
        let moved = [0.5 * f64::from(i); 4];
        let untouched = reading(i, moved, 0.0, 0.0);
        assert_eq!(follow(&mut tare, untouched).status, Status::NoContact, "{i}");
        assert_eq!(tare.baseline(), untouched);
        assert_eq!(follow(&mut tare, reading(i, moved, 1.5, 0.3)).status, Status::Located, "{i}");
        assert_eq!(tare.baseline(), untouched);
    }
}

#[test]
fn a_slow_touch_does_not_go_into_the_baseline_of_a_fast_board() {
    // The force grows from 0 to 1.5 within 0.8 s at 1,000 readings a second, after rests of several
    // lengths.
    for is_last in [false, true] {
        for rest in [1500_u32, 1700, 1950, 2300] {
            let tare = Tare::new(LEARNT).unwrap();
            let mut tare = if is_last { tare.with_last_zero() } else { tare };
            for i in 0..rest + 1500 {
                tare.note_time(f64::from(i) * 1e-3);
                let force = 1.5 * f64::from(i.saturating_sub(rest).min(800)) / 800.0;
                follow(&mut tare, reading(i, MOVED, force, 0.3));
            }
            // The error of the baseline is below the detection threshold.
            let errors = (0..4).map(|c| tare.baseline()[c] - LEARNT[c] - MOVED[c]);
            let square: f64 = errors.map(|error| error * error).sum();
            assert!(square < 20.0, "{is_last}, {rest}: {square}");
        }
    }
}

#[test]
fn a_surface_that_moved_is_found_and_a_held_contact_stays() {
    let mut tare = Tare::new(LEARNT).unwrap();
    follow_many(&mut tare, 0..60, (0.0, 0.0));
    assert!(is_right(&tare, MOVED), "{:?}", tare.baseline());
    for i in 0..5000 {
        let estimate = follow(&mut tare, reading(i, MOVED, 1.5, 0.3));
        assert_eq!(estimate.status, Status::Located);
        assert!((estimate.contact.position.x_m - 0.3).abs() < 0.05);
    }
    assert!(is_right(&tare, MOVED), "{:?}", tare.baseline());
    assert_eq!(follow(&mut tare, reading(1, MOVED, 0.0, 0.0)).status, Status::NoContact);
}

#[test]
fn the_drift_of_a_calibration_goes_on_until_the_first_reading() {
    // The channels have drifted like a contact of 1.5 at 0.3; a sixth of the drift follows the
    // calibration.
    let drifted = influence(0.3).map(|influence| 1.5 * influence);
    let last: [f64; 4] = core::array::from_fn(|c| LEARNT[c] + drifted[c] / 1.2);
    let moved = |i: u32, force: f64| reading(i, drifted, force, 0.7);
    let mut unaware = Tare::new(LEARNT).unwrap();
    let mut aware = unaware.clone().with_drift(last, drifted.map(|d| d.abs().max(5.0))).unwrap();
    assert_eq!(follow(&mut unaware, moved(0, 0.0)).status, Status::Located);
    for i in 0..1000 {
        let force = if (300..500).contains(&i) { 1.0 } else { 0.0 };
        let estimate = follow(&mut aware, moved(i, force));
        assert_eq!(estimate.status == Status::NoContact, force == 0.0, "{i}");
    }
    assert!(is_right(&aware, drifted), "{:?}", aware.baseline());
    // A contact at another position does not count as drift. After a contact within the reach the
    // baseline is correct.
    let mut touched = aware.restarted();
    assert_eq!(follow(&mut touched, reading(0, [0.0; 4], 4.0, 0.7)).status, Status::Located);
    let mut touched = aware.restarted();
    for i in 0..400 {
        follow(&mut touched, reading(i, drifted, if i < 200 { 0.5 } else { 0.0 }, 0.3));
    }
    assert!(is_right(&touched, drifted), "{:?}", touched.baseline());
}

#[test]
fn a_slow_drift_is_followed_while_nothing_touches() {
    let mut tare = Tare::new(LEARNT).unwrap();
    let moved = |i: u32| MOVED.map(|moved| moved * f64::from(i) / 100_000.0);
    for i in 0..100_000 {
        let touched = i % 500 < 50;
        let estimate = follow(&mut tare, reading(i, moved(i), if touched { 1.0 } else { 0.0 }, 0.7));
        assert_eq!(estimate.status == Status::NoContact, !touched, "{i}");
    }
    assert!(is_right(&tare, moved(100_000)), "{:?}", tare.baseline());
}

/// Locator for a known force of 15.
fn locate_known(reading: &[f64]) -> Estimate {
    let d: [f64; 4] = core::array::from_fn(|c| reading[c] - LEARNT[c]);
    let square: f64 = d.iter().map(|d| d * d).sum();
    let misfit = |x: f64| {
        let f = influence(x);
        f.iter().zip(&d).map(|(f, d)| (d - 15.0 * f) * (d - 15.0 * f)).sum::<f64>()
    };
    let places = (0..=2000).map(|i| f64::from(i) / 2000.0);
    let x = places.min_by(|a, b| misfit(*a).total_cmp(&misfit(*b))).unwrap();
    let status = match misfit(x) {
        _ if square < 20.0 => Status::NoContact,
        misfit if misfit < 40.0 => Status::Located,
        _ => Status::OutsideModel,
    };
    Estimate::of_position(Position::along(x), status)
}

/// Presses of 15 with a drift per reading and a residue, at 100 Hz.
fn presses_end(locate: fn(&[f64]) -> Estimate, drift: f64, residue: f64) {
    let mut tare = Tare::new(LEARNT).unwrap();
    let mut number = 0;
    let mut next = |tare: &mut Tare<[f64; 4]>, force: f64, x: f64, left: f64| {
        number += 1;
        let moved = core::array::from_fn(|c| {
            let way = if c % 2 == 0 { 1.0 } else { -0.6 };
            MOVED[c] + drift * way * f64::from(number) + left * way
        });
        let mut tared = [0.0; 4];
        tare.locate_and_update(&reading(number, moved, force, x), &mut tared, locate).unwrap().status
    };
    for _ in 0..300 {
        next(&mut tare, 0.0, 0.0, 0.0);
    }
    for press in 0..20 {
        let x = f64::from(press * 7 % 20) / 20.0;
        let left = if press % 3 == 0 { -residue } else { residue };
        let hold = 100 + press * 15;
        for i in 0..hold + 100 {
            let share = f64::from((i + 1).min(50).min(hold + 100 - i)) / 50.0;
            next(&mut tare, 15.0 * share, x, left);
        }
        let rest: [Status; 150] = core::array::from_fn(|_| next(&mut tare, 0.0, 0.0, left));
        let late = rest[100..].iter().filter(|status| **status != Status::NoContact).count();
        assert!(late == 0, "press {press}: {late} of 50 readings are not at rest");
        for _ in 0..press * 23 {
            next(&mut tare, 0.0, 0.0, left);
        }
    }
}

#[test]
fn a_press_ends_within_a_second_on_a_board_that_drifts_and_leaves_a_residue() {
    presses_end(locate_known, 0.02, 0.0);
    presses_end(locate, 0.02, 0.0);
    presses_end(locate, 0.01, 6.0);
}

#[test]
fn a_board_that_is_touched_while_it_starts_is_right_once_it_is_let_go() {
    let mut tare = Tare::new(LEARNT).unwrap();
    follow_many(&mut tare, 0..300, (2.0, 0.4));
    assert!(!is_right(&tare, MOVED));
    follow_many(&mut tare, 0..60, (0.0, 0.0));
    assert!(is_right(&tare, MOVED), "{:?}", tare.baseline());
}

fn follow_palm(tare: &mut Tare<[f64; 4]>, numbers: core::ops::Range<u32>, moved: [f64; 4]) -> Estimate {
    let mut estimate = None;
    for number in numbers {
        let palm: [f64; 4] =
            core::array::from_fn(|c| reading(number, moved, 2.0, 0.0)[c] + 2.0 * influence(1.0)[c]);
        estimate = Some(follow(tare, palm));
    }
    estimate.unwrap()
}

#[test]
fn a_palm_while_a_board_starts_that_has_not_moved_is_forgotten_once_it_is_gone() {
    let mut tare = Tare::new(LEARNT).unwrap();
    assert_eq!(follow_palm(&mut tare, 0..300, [0.0; 4]).status, Status::NoContact);
    assert!(!tare.is_confirmed());
    for number in 0..10 {
        follow(&mut tare, reading(number, [0.0; 4], 0.0, 0.0));
    }
    assert!(is_right(&tare, [0.0; 4]) && tare.is_confirmed(), "{:?}", tare.baseline());
}

#[test]
fn a_palm_while_a_moved_board_starts_is_forgotten_once_a_contact_has_come_and_gone() {
    let mut tare = Tare::new(LEARNT).unwrap();
    follow_palm(&mut tare, 0..300, MOVED);
    // These readings resemble a palm on an untouched board.
    follow_many(&mut tare, 0..100, (0.0, 0.0));
    assert_eq!(follow(&mut tare, reading(1, MOVED, 0.0, 0.0)).status, Status::OutsideModel);
    follow_many(&mut tare, 0..20, (1.5, 0.6));
    follow_many(&mut tare, 0..20, (0.0, 0.0));
    assert!(is_right(&tare, MOVED) && tare.is_confirmed(), "{:?}", tare.baseline());
    assert_eq!(follow_palm(&mut tare, 0..3000, MOVED).status, Status::OutsideModel);
}

#[test]
fn object_on_a_moved_board_from_the_start_may_be_touched_and_removed() {
    let mut tare = Tare::new(LEARNT).unwrap();
    follow_many(&mut tare, 0..60, (0.0, 0.0));
    // A finger presses on the object first: that confirms the wrong baseline.
    follow_palm(&mut tare, 0..60, MOVED);
    let mut on_top = MOVED;
    for (c, moved) in on_top.iter_mut().enumerate() {
        *moved += 2.0 * (influence(0.0)[c] + influence(1.0)[c]);
    }
    for (number, force) in [(0..20, 1.5), (20..40, 0.0)].into_iter().flat_map(|(r, f)| r.map(move |n| (n, f)))
    {
        follow(&mut tare, reading(number, on_top, force, 0.6));
    }
    assert!(is_right(&tare, on_top), "{:?}", tare.baseline());
    follow_many(&mut tare, 0..20, (0.0, 0.0));
    follow_many(&mut tare, 0..20, (1.5, 0.3));
    follow_many(&mut tare, 0..20, (0.0, 0.0));
    assert!(is_right(&tare, MOVED), "{:?}", tare.baseline());
}

#[test]
fn two_contacts_of_which_one_comes_and_goes_are_not_tared_away() {
    let mut tare = Tare::new(LEARNT).unwrap();
    follow_many(&mut tare, 0..60, (0.0, 0.0));
    follow_many(&mut tare, 0..20, (1.5, 0.3));
    follow_many(&mut tare, 0..20, (0.0, 0.0));
    for i in 0..3000 {
        let further = if i % 100 < 50 { 1.5 } else { 0.0 };
        let palm: [f64; 4] = core::array::from_fn(|c| {
            reading(i, MOVED, 2.0, 0.0)[c] + 2.0 * influence(1.0)[c] + further * influence(0.4)[c]
        });
        follow(&mut tare, palm);
    }
    assert!(is_right(&tare, MOVED), "{:?}", tare.baseline());
}

#[test]
fn immense_readings_are_no_baseline() {
    let mut tare = Tare::new([0.0; 4]).unwrap();
    let mut tared = [0.0; 4];
    for _ in 0..100 {
        let estimate = tare.locate_and_update(&[1e308; 4], &mut tared, |_| {
            Estimate::of_position(Position::along(0.5), Status::OutsideModel)
        });
        assert_eq!(estimate.unwrap().status, Status::OutsideModel);
    }
    assert_eq!(tare, Tare::new([0.0; 4]).unwrap());
}

#[test]
fn one_loud_reading_is_not_taken_for_a_surface_that_was_let_go() {
    let mut tare = Tare::new(LEARNT).unwrap();
    follow_many(&mut tare, 0..2000, (0.0, 0.0));
    // The negative of a contact.
    for _ in 0..Tare::<[f64; 4]>::LET_GO - 1 {
        assert_eq!(follow(&mut tare, reading(7, MOVED, -0.4, 0.4)).status, Status::OutsideModel);
    }
    assert!(is_right(&tare, MOVED), "{:?}", tare.baseline());
    follow_many(&mut tare, 0..1, (0.0, 0.0));
    follow(&mut tare, reading(7, MOVED, -0.4, 0.4));
    assert!(is_right(&tare, MOVED), "{:?}", tare.baseline());
}

#[test]
fn a_palm_is_not_tared_away() {
    let mut tare = Tare::new(LEARNT).unwrap();
    follow_many(&mut tare, 0..60, (0.0, 0.0));
    for i in 0..3000 {
        assert_eq!(follow_palm(&mut tare, i..i + 1, MOVED).status, Status::OutsideModel);
    }
    assert!(is_right(&tare, MOVED), "{:?}", tare.baseline());
}

#[test]
fn bad_readings_are_refused_and_leave_the_baseline() {
    let mut tare = Tare::new([1.0, 2.0]).unwrap();
    let channels = TareError::Channels { needed: 2, found: 1 };
    assert_eq!(tare.add_untouched(&[1.0]), Err(channels));
    assert_eq!(tare.apply(&[1.0, 2.0], &mut [0.0]), Err(channels));
    assert!(matches!(tare.add_untouched(&[1.0, f64::NAN]), Err(TareError::NotFinite { channel: 2, .. })));
    assert!(matches!(Tare::new([f64::INFINITY]), Err(TareError::NotFinite { channel: 1, .. })));
    assert_eq!(tare, Tare::new([1.0, 2.0]).unwrap());
}
