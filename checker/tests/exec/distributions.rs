//! Random functions: the same numbers on every engine, their moments, and what they refuse.

use checker::exec::RunTimeError;
use checker::ir::{
    Address, Base, Block, Distribution, Function, FunctionId, Instruction, Overflow, Register,
    RegisterType, RunTimeErrorKind, STREAM_WORDS, SiteId, Stream, Terminator,
};

use crate::support::{engines, run, state_word, straight_line};

use Distribution as D;
use RegisterType::{Double, Integer};

const SITE: SiteId = SiteId(77);
const SEED: u64 = 0x5eed_0000_0000_5eed;
const RUN: u64 = 12;
/// Where the results of the functions under test lie, behind the stream.
const RESULTS: u32 = STREAM_WORDS as u32;

/// The doubles at the given word and behind.
fn doubles(words: &[i32]) -> Vec<f64> {
    let pairs = words.chunks_exact(2);
    pairs
        .map(|pair| {
            let [low, high] = [pair[0], pair[1]].map(|word| u64::from(word as u32));
            f64::from_bits(high << 32 | low)
        })
        .collect()
}

/// A state with the start of a run, and room for results.
fn start(results: usize) -> Vec<i32> {
    let mut state = vec![0; STREAM_WORDS + 2 * results];
    Stream::start(&mut state, SEED, RUN);
    state
}

/// Draws a number with constant arguments into the register behind them.
fn draw(distribution: Distribution, arguments: &[f64], stream: Address) -> Vec<Instruction> {
    let registers = || (0..arguments.len() as u32).map(Register);
    let mut instructions: Vec<_> = registers()
        .zip(arguments)
        .map(|(target, &value)| Instruction::Double {
            target,
            value: value.into(),
        })
        .collect();
    instructions.push(Instruction::Random {
        distribution,
        target: Register(arguments.len() as u32),
        arguments: registers().collect(),
        stream,
        site: SITE,
    });
    instructions
}

/// Arguments inside the domains, one list for each way in which a number is found.
const CASES: &[(Distribution, &[f64])] = &[
    (D::Uniform, &[6.0]),
    (D::Uniform, &[-0.25]),
    (D::Uniform, &[0.0]),
    (D::Normal, &[3.0, 2.0]),
    (D::Normal, &[-1.0, 0.0]),
    (D::Poisson, &[0.0]),
    (D::Poisson, &[2.5]),
    (D::Poisson, &[40.0]),
    (D::Arcsine, &[-1.0, 3.0]),
    (D::Arcsine, &[2.0, 2.0]),
    (D::Beta, &[2.0, 5.0]),
    (D::Beta, &[0.5, 0.7]),
    (D::Gamma, &[0.5, 3.0]),
    (D::Gamma, &[1.0, 3.0]),
    (D::Gamma, &[4.5, 0.5]),
    (D::Triangular, &[-1.0, 0.0, 3.0]),
    (D::Triangular, &[1.0, 1.0, 1.0]),
    (D::Weibull, &[1.5, 2.0]),
    (D::Weibull, &[1.0, 0.5]),
];

/// Mean and variance in closed form.
fn moments(distribution: Distribution, arguments: &[f64]) -> (f64, f64) {
    match (distribution, arguments) {
        (D::Uniform, &[max]) => (max / 2.0, max * max / 12.0),
        (D::Normal, &[mean, deviation]) => (mean, deviation * deviation),
        (D::Poisson, &[rate]) => (rate, rate),
        (D::Arcsine, &[low, high]) => (f64::midpoint(low, high), (high - low).powi(2) / 8.0),
        (D::Beta, &[alpha, beta]) => {
            let sum = alpha + beta;
            (alpha / sum, alpha * beta / (sum * sum * (sum + 1.0)))
        }
        (D::Gamma, &[shape, scale]) => (shape * scale, shape * scale * scale),
        (D::Triangular, &[low, mode, high]) => {
            let products = low * mode + low * high + mode * high;
            let squares = low * low + mode * mode + high * high;
            ((low + mode + high) / 3.0, (squares - products) / 18.0)
        }
        (D::Weibull, &[shape, scale]) => {
            let [first, second] = match shape {
                1.0 => [1.0, 2.0],
                // Γ(1 + 2/3) and Γ(1 + 4/3).
                1.5 => [0.902_745_292_950_933_6, 1.190_639_348_758_998_9],
                _ => panic!("the gamma function of this shape is not in the table"),
            };
            (scale * first, scale * scale * (second - first * first))
        }
        _ => panic!("another number of arguments"),
    }
}

/// How many numbers are drawn for their moments.
const DRAWS: u32 = 100_000;

/// The mean of [`DRAWS`] numbers.
fn mean_of(values: impl Iterator<Item = f64>) -> f64 {
    values.sum::<f64>() / f64::from(DRAWS)
}

#[test]
fn means_and_variances_are_those_of_the_distributions() {
    for (run, &(distribution, arguments)) in (0..).zip(CASES) {
        let mut words = [0; STREAM_WORDS];
        let mut stream = Stream::start(&mut words, SEED, run);
        let drawn: Vec<f64> = (0..DRAWS)
            .map(|_| distribution.sample(&mut stream, arguments))
            .collect::<Option<_>>()
            .expect("the arguments are in the domain");
        let (mean, variance) = moments(distribution, arguments);
        let deviations = || drawn.iter().map(|value| value - mean);
        let (first, second, fourth) = (
            mean_of(deviations()),
            mean_of(deviations().map(|one| one.powi(2))),
            mean_of(deviations().map(|one| one.powi(4))),
        );
        let five_errors = |variance: f64| 5.0 * (variance / f64::from(DRAWS)).sqrt() + 1e-12;
        let name = distribution.name();
        assert!(
            first.abs() <= five_errors(variance),
            "{name} {arguments:?}: the mean is {first} beside {mean}"
        );
        assert!(
            (second - variance).abs() <= five_errors(fourth - second * second),
            "{name} {arguments:?}: the variance is {second} instead of {variance}"
        );
    }
}

#[test]
fn numbers_lie_where_they_should() {
    let mut words = [0; STREAM_WORDS];
    let mut stream = Stream::start(&mut words, SEED, RUN);
    for _ in 0..10_000 {
        let mut inside = |distribution: D, arguments: &[f64], low: f64, high: f64| {
            let value = distribution.sample(&mut stream, arguments);
            let value = value.expect("the arguments are in the domain");
            assert!(low <= value && value <= high, "{distribution:?}: {value}");
            value
        };
        assert!(inside(D::Uniform, &[6.0], 0.0, 6.0) < 6.0);
        assert!(inside(D::Uniform, &[-6.0], -6.0, 0.0) > -6.0);
        inside(D::Arcsine, &[1.0, 2.0], 1.0, 2.0);
        inside(D::Beta, &[0.3, 0.4], 0.0, 1.0);
        inside(D::Triangular, &[1.0, 2.0, 4.0], 1.0, 4.0);
        let events = inside(D::Poisson, &[20.0], 0.0, 1000.0);
        assert_eq!(events.to_bits(), events.trunc().to_bits());
    }
}

#[test]
fn the_simulators_numbers_lie_where_they_should() {
    let mut words = [0; STREAM_WORDS];
    let mut stream = Stream::start(&mut words, SEED, RUN);
    let mut counts = [0_u32; 6];
    let mut waited = 0.0;
    for _ in 0..DRAWS {
        counts[stream.below(6) as usize] += 1;
        assert!((0.0..1.0).contains(&stream.uniform()));
        waited += stream.exponential(4.0);
    }
    // Five standard errors: of a count, and of a mean whose deviation is 1/4.
    let error = (f64::from(DRAWS) * 5.0 / 36.0).sqrt();
    for count in counts {
        let difference = f64::from(count) - f64::from(DRAWS) / 6.0;
        assert!(difference.abs() <= 5.0 * error, "{counts:?}");
    }
    let mean = waited / f64::from(DRAWS);
    assert!((mean - 0.25).abs() <= 5.0 * 0.25 / f64::from(DRAWS).sqrt());
    assert_eq!(stream.below(1), 0);
}

#[test]
fn a_run_does_not_depend_on_what_ran_before() {
    let drawn = |seed: u64, run: u64| {
        let mut words = [-1; STREAM_WORDS + 3];
        let mut stream = Stream::start(&mut words, seed, run);
        let drawn: Vec<u64> = (0..5).map(|_| stream.uniform().to_bits()).collect();
        assert_eq!(words[STREAM_WORDS..], [-1; 3]);
        drawn
    };
    let first = drawn(1, 2);
    for (seed, run) in [(2, 1), (1, 3), (1, 2 | 1 << 32), (1 | 1 << 32, 2)] {
        assert_ne!(drawn(seed, run), first);
    }
    assert_eq!(drawn(1, 2), first);
}

/// A loop of draws into one word after the other: `for (i : 0 .. 999) results[i] = draw()`.
fn thousand_draws(distribution: Distribution, arguments: &[f64]) -> Function {
    let number = arguments.len() as u32;
    let [value, position, index, one, goes_on] = [0, 1, 2, 3, 4].map(|one| Register(number + one));
    let mut registers = vec![Double; number as usize + 1];
    registers.extend([Integer; 4]);
    let mut body = draw(distribution, arguments, state_word(0));
    body.extend([
        Instruction::ScaleIndex {
            target: index,
            index: position,
            first: 0,
            length: 1000,
            stride: 2,
            site: SITE,
        },
        Instruction::StoreDouble {
            address: Address {
                index: Some(index),
                ..state_word(RESULTS)
            },
            source: value,
            is_number: false,
        },
        Instruction::Integer {
            target: one,
            value: 1,
        },
        Instruction::AddIndices {
            target: position,
            left: position,
            right: one,
        },
        Instruction::Integer {
            target: one,
            value: 1000,
        },
        Instruction::CompareIntegers {
            relation: checker::ir::Relation::Less,
            target: goes_on,
            left: position,
            right: one,
        },
    ]);
    let block = |instructions, terminator| Block {
        instructions,
        terminator,
    };
    let [entry, head, end] = [0, 1, 2].map(checker::ir::BlockId);
    assert_eq!(entry.0, 0);
    Function {
        blocks: vec![
            block(
                vec![Instruction::Integer {
                    target: position,
                    value: 0,
                }],
                Terminator::Jump(head),
            ),
            block(body, Terminator::Branch(goes_on, head, end)),
            block(Vec::new(), Terminator::Return(None)),
        ],
        ..straight_line(0, &registers, Vec::new(), None)
    }
}

#[test]
fn all_engines_draw_the_same_thousand_numbers() {
    for &(distribution, arguments) in CASES {
        let mut expected = start(1000);
        let mut stream = Stream::of(&mut expected);
        let drawn: Vec<u64> = (0..1000)
            .map(|_| distribution.sample(&mut stream, arguments))
            .map(|value| value.expect("the arguments are in the domain").to_bits())
            .collect();
        let function = thousand_draws(distribution, arguments);
        for (name, engine) in engines(std::slice::from_ref(&function), &[], Overflow::Wrap) {
            let outcome = run(&*engine, FunctionId(0), &[], &start(1000));
            assert_eq!(outcome.result, Ok(0), "{name}: {function:?}");
            let (stream, results) = outcome.state.split_at(STREAM_WORDS);
            let results = doubles(results);
            assert!(
                drawn
                    .iter()
                    .copied()
                    .eq(results.iter().map(|one| one.to_bits())),
                "{name}: {function:?}"
            );
            assert_eq!(stream, &expected[..STREAM_WORDS], "{name}: {function:?}");
        }
    }
}

/// Draws of one kind with the same arguments, between reads of the words of the stream: none is
/// left out or taken twice, and no word is remembered across a draw.
#[test]
fn equal_draws_are_all_made() {
    let mut instructions = Vec::new();
    let position = |target| Instruction::LoadInteger {
        target: Register(target),
        address: state_word(4),
    };
    instructions.push(position(2));
    instructions.extend(draw(D::Uniform, &[1.0], state_word(0)));
    // The result of this one is not used.
    instructions.extend(draw(D::Uniform, &[1.0], state_word(0)));
    instructions.push(position(3));
    instructions.push(Instruction::CompareIntegers {
        relation: checker::ir::Relation::NotEqual,
        target: Register(2),
        left: Register(2),
        right: Register(3),
    });
    let registers = [Double, Double, Integer, Integer];
    let function = straight_line(0, &registers, instructions, Some(2));
    for (name, engine) in engines(std::slice::from_ref(&function), &[], Overflow::Wrap) {
        let outcome = run(&*engine, FunctionId(0), &[], &start(0));
        assert_eq!(outcome.result, Ok(1), "{name}: {function:?}");
        assert_eq!(outcome.state[4], 2, "{name}: {function:?}");
    }
}

/// The words may lie in a frame as well, and behind an address in a register.
#[test]
fn streams_lie_anywhere() {
    let store = |target, source| Instruction::StoreDouble {
        address: state_word(target),
        source: Register(source),
        is_number: false,
    };
    let in_frame = Address {
        base: Base::Frame,
        offset: 1,
        index: None,
    };
    let by_register = Address {
        base: Base::Register(Register(2)),
        ..in_frame
    };
    let mut instructions = draw(D::Uniform, &[1.0], in_frame);
    instructions.push(store(0, 1));
    instructions.push(Instruction::AddressOf {
        target: Register(2),
        address: Address {
            offset: 0,
            ..in_frame
        },
    });
    instructions.extend(draw(D::Uniform, &[1.0], by_register));
    instructions.push(store(2, 1));
    let registers = [Double, Double, RegisterType::Address];
    let function = Function {
        frame_words: STREAM_WORDS as u32 + 1,
        ..straight_line(0, &registers, instructions, None)
    };
    let mut words = [0; STREAM_WORDS];
    let mut stream = Stream::of(&mut words);
    let expected = [stream.uniform(), stream.uniform()].map(f64::to_bits);
    for (name, engine) in engines(std::slice::from_ref(&function), &[], Overflow::Wrap) {
        let outcome = run(&*engine, FunctionId(0), &[], &[0; 4]);
        let drawn = doubles(&outcome.state);
        assert!(
            drawn.iter().map(|one| one.to_bits()).eq(expected),
            "{name}: {function:?}"
        );
    }
}

#[test]
fn parameters_out_of_their_domains_are_errors() {
    const NAN: f64 = f64::NAN;
    const INFINITY: f64 = f64::INFINITY;
    let cases: &[(Distribution, &[f64])] = &[
        (D::Uniform, &[NAN]),
        (D::Uniform, &[-INFINITY]),
        (D::Normal, &[0.0, -1.0]),
        (D::Normal, &[INFINITY, 1.0]),
        (D::Normal, &[0.0, NAN]),
        (D::Poisson, &[-1.0]),
        (D::Poisson, &[1e20]),
        (D::Poisson, &[NAN]),
        (D::Arcsine, &[1.0, 0.0]),
        (D::Arcsine, &[-f64::MAX, f64::MAX]),
        (D::Beta, &[0.0, 1.0]),
        (D::Beta, &[1.0, -1.0]),
        (D::Beta, &[f64::MAX, f64::MAX]),
        (D::Gamma, &[0.0, 1.0]),
        (D::Gamma, &[1.0, 0.0]),
        (D::Gamma, &[INFINITY, 1.0]),
        (D::Triangular, &[0.0, 2.0, 1.0]),
        (D::Triangular, &[1.0, 0.5, 0.0]),
        (D::Triangular, &[-f64::MAX, 0.0, f64::MAX]),
        (D::Weibull, &[-1.0, 1.0]),
        (D::Weibull, &[1.0, 0.0]),
        (D::Weibull, &[1.0, NAN]),
    ];
    for &(distribution, arguments) in cases {
        let mut registers = vec![Double; arguments.len()];
        registers.push(Double);
        let instructions = draw(distribution, arguments, state_word(0));
        let function = straight_line(0, &registers, instructions, None);
        let error = RunTimeError {
            kind: RunTimeErrorKind::Parameter(distribution),
            site: SITE,
        };
        for (name, engine) in engines(std::slice::from_ref(&function), &[], Overflow::Wrap) {
            let outcome = run(&*engine, FunctionId(0), &[], &start(0));
            assert_eq!(outcome.result, Err(error), "{name}: {function:?}");
        }
    }
}
