//! Values: numbers, parameters, functions and bracketed expressions, evaluated while they are read.

use crate::error::ErrorKind;
use crate::functions;
use crate::lexer::{self, Function, Operator, Read, Rest, byte, fault, fault_here};
use pkm_kins::maths;

/// What an expression can look up.
pub(crate) trait Scope {
    /// `#index`, 1 to 5601.
    fn numbered(&self, index: i32) -> Result<f64, ErrorKind>;
    /// `#<name>`.
    fn named(&self, name: &[u8]) -> Option<f64>;
    /// EQ and NE: how far two equal numbers may differ. `ordered` = GE and LE use it too.
    fn tolerance(&self) -> Tolerance;
    /// Two signs in a row are an error.
    fn strict(&self) -> bool;
    /// `EXISTS[#<name>]`.
    fn exists(&self, name: &[u8]) -> bool {
        self.named(name).is_some()
    }
    /// The text is only read, not run: NaN stands for a value that only a run can tell.
    fn is_static(&self) -> bool {
        false
    }
}

/// Rules of comparison; they differ between LinuxCNC's versions.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Tolerance {
    pub(crate) equal: f64,
    pub(crate) ordered: bool,
}

/// Deepest accepted nesting of brackets and indirections (promise P5).
pub(crate) const MAX_DEPTH: u8 = 64;

/// A whole number that only a run can tell (see [`Scope::is_static`]).
pub(crate) const UNKNOWN: i32 = i32::MIN;

/// Highest parameter number.
pub(crate) const LAST_PARAMETER: i32 = 5601;

/// A value: number, `[expression]`, `#parameter` or function, with any signs before it.
pub(crate) fn value<'a>(input: Rest<'a>, scope: &impl Scope) -> Read<'a, f64> {
    signed_value(input, scope, 0)
}

/// A value that must be whole within 0.0001.
pub(crate) fn integer<'a>(input: Rest<'a>, scope: &impl Scope) -> Read<'a, i32> {
    integer_at(input, scope, 0)
}

/// An expression in brackets.
#[cfg(feature = "alloc")]
pub(crate) fn bracketed<'a>(input: Rest<'a>, scope: &impl Scope) -> Read<'a, f64> {
    let (rest, result) = bracket(input, scope, 0)?;
    finite(result, scope, input, rest)
}

fn integer_at<'a>(input: Rest<'a>, scope: &impl Scope, depth: u8) -> Read<'a, i32> {
    if let Some(plain) = lexer::plain_integer(input) {
        return Ok(plain);
    }
    let (rest, value) = signed_value(input, scope, depth)?;
    if value.is_nan() {
        return Ok((rest, UNKNOWN));
    }
    let rounded = maths::floor(value + 0.5);
    if (value - rounded).abs() > 0.0001 || rounded.abs() > 2e9 {
        return Err(fault(ErrorKind::NotInteger { value }, input, rest));
    }
    Ok((rest, rounded as i32))
}

fn signed_value<'a>(input: Rest<'a>, scope: &impl Scope, depth: u8) -> Read<'a, f64> {
    let (mut rest, mut negative, mut signs) = (input, false, 0);
    // A sign before a digit belongs to the number; before anything else it is unary.
    while let [sign @ (b'+' | b'-'), next, ..] = rest {
        if next.is_ascii_digit() || *next == b'.' {
            break;
        }
        negative ^= *sign == b'-';
        signs += 1;
        rest = &rest[1..];
    }
    if signs > 0 && scope.strict() && signs + i32::from(matches!(rest, [b'+' | b'-', ..])) > 1 {
        return Err(fault(ErrorKind::DoubleSign, input, rest));
    }
    let (after, value) = match rest {
        [b'[', ..] => bracket(rest, scope, depth),
        [b'#', ..] => parameter(rest, scope, depth),
        [b'a'..=b'z', ..] => function(rest, scope, depth),
        _ => lexer::number(rest),
    }?;
    finite(if negative { -value } else { value }, scope, input, after)
}

fn finite<'a>(value: f64, scope: &impl Scope, from: Rest<'a>, to: Rest<'a>) -> Read<'a, f64> {
    if value.is_nan() && !scope.is_static() {
        return Err(fault(ErrorKind::MathNan, from, to));
    }
    if value.is_infinite() {
        return Err(fault(ErrorKind::MathInf, from, to));
    }
    Ok((to, value))
}

fn deeper(depth: u8, at: Rest<'_>) -> Result<u8, nom::Err<lexer::Fault>> {
    if depth < MAX_DEPTH {
        Ok(depth + 1)
    } else {
        Err(fault_here(ErrorKind::ExprDepth { limit: MAX_DEPTH }, at))
    }
}

/// `[ value operator value ... ]`, left-associative. The stack holds operators of rising level only, so five
/// places (one per level) are enough.
fn bracket<'a>(input: Rest<'a>, scope: &impl Scope, depth: u8) -> Read<'a, f64> {
    let depth = deeper(depth, input)?;
    let (mut rest, ()) = byte(b'[')(input)?;
    let mut stack: heapless::Vec<(f64, Operator, Rest<'a>), 6> = heapless::Vec::new();
    loop {
        let start = rest;
        let (after, mut right) = signed_value(rest, scope, depth)?;
        let next = match after {
            [b']', ..] => None,
            [] => return Err(fault(ErrorKind::ExprUnclosed, input, after)),
            _ => Some(lexer::operator(after).map_err(|_| fault_here(ErrorKind::ExprOperator, after))?),
        };
        let level = next.map_or(0, |(_, operator)| operator.level());
        let mut from = start;
        while let Some(&(left, operator, left_from)) = stack.last() {
            if operator.level() < level {
                break;
            }
            stack.pop();
            from = left_from;
            right = apply(left, operator, right, scope).map_err(|kind| fault(kind, from, after))?;
        }
        match next {
            None => return Ok((&after[1..], right)),
            Some((after_operator, operator)) => {
                // Cannot fail: levels on the stack rise strictly and there are five of them.
                let _ = stack.push((right, operator, from));
                rest = after_operator;
            }
        }
    }
}

fn apply(left: f64, operator: Operator, right: f64, scope: &impl Scope) -> Result<f64, ErrorKind> {
    let truth = |condition: bool| if condition { 1.0 } else { 0.0 };
    let Tolerance { equal, ordered } = scope.tolerance();
    let same = || (left - right).abs() < equal;
    if scope.is_static() && (left.is_nan() || right.is_nan()) {
        return Ok(f64::NAN);
    }
    Ok(match operator {
        Operator::Power if left < 0.0 && maths::floor(right) != right => return Err(ErrorKind::MathPower),
        Operator::Power => functions::pow(left, right),
        Operator::Multiply => left * right,
        Operator::Divide if right == 0.0 => return Err(ErrorKind::MathDiv0),
        Operator::Divide => left / right,
        Operator::Modulo => {
            let remainder = left % right;
            if remainder < 0.0 { remainder + right.abs() } else { remainder }
        }
        Operator::Add => left + right,
        Operator::Subtract => left - right,
        Operator::Equal => truth(same()),
        Operator::NotEqual => truth(!same()),
        Operator::Greater => truth(left > right),
        Operator::GreaterEqual => truth(left >= right || (ordered && same())),
        Operator::Less => truth(left < right),
        Operator::LessEqual => truth(left <= right || (ordered && same())),
        Operator::And => truth(left != 0.0 && right != 0.0),
        Operator::Or => truth(left != 0.0 || right != 0.0),
        Operator::Xor => truth((left != 0.0) != (right != 0.0)),
    })
}

/// `#n`, `#[expression]`, `##n`, `#<name>`.
fn parameter<'a>(input: Rest<'a>, scope: &impl Scope, depth: u8) -> Read<'a, f64> {
    let (rest, reference) = reference(input, scope, depth)?;
    let value = match reference {
        Reference::Number(index) => scope.numbered(index).map_err(|kind| fault(kind, input, rest))?,
        Reference::Name(name) => {
            scope.named(name).ok_or_else(|| fault(ErrorKind::ParamUndefined, input, rest))?
        }
    };
    Ok((rest, value))
}

/// What stands behind a `#`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Reference<'a> {
    /// 1 to 5601.
    Number(i32),
    /// Between the angle brackets.
    Name(&'a [u8]),
}

/// `#` and the number or name of a parameter.
pub(crate) fn reference<'a>(input: Rest<'a>, scope: &impl Scope, depth: u8) -> Read<'a, Reference<'a>> {
    let depth = deeper(depth, input)?;
    let (rest, ()) = byte(b'#')(input)?;
    if rest.first() == Some(&b'<') {
        let (rest, name) =
            lexer::name(rest).map_err(|_| fault(ErrorKind::ParamNameOpen, input, &rest[rest.len()..]))?;
        return Ok((rest, Reference::Name(name)));
    }
    let (rest, index) = integer_at(rest, scope, depth)?;
    if !(1..=LAST_PARAMETER).contains(&index) && index != UNKNOWN {
        return Err(fault(ErrorKind::ParamRange { value: index.into() }, input, rest));
    }
    Ok((rest, Reference::Number(index)))
}

fn function<'a>(input: Rest<'a>, scope: &impl Scope, depth: u8) -> Read<'a, f64> {
    let (rest, function) = lexer::function(input).map_err(|_| {
        let rest = lexer::letters(input).map_or(&input[input.len()..], |(rest, _)| rest);
        fault(ErrorKind::ExprFunction, input, rest)
    })?;
    if rest.first() != Some(&b'[') {
        return Err(fault(ErrorKind::ExprBracket, input, rest));
    }
    if function == Function::Exists {
        return exists(rest, scope, depth);
    }
    let (rest, x) = bracket(rest, scope, depth)?;
    if function == Function::Atan {
        let wrong = || fault(ErrorKind::ExprAtan, input, rest);
        let [b'/', after @ ..] = rest else { return Err(wrong()) };
        if after.first() != Some(&b'[') {
            return Err(wrong());
        }
        let (rest, second) = bracket(after, scope, depth)?;
        return Ok((rest, functions::atan2(x, second)));
    }
    if x.is_nan() {
        return Ok((rest, x));
    }
    let result = call(function, x).map_err(|kind| fault(kind, input, rest))?;
    Ok((rest, result))
}

/// `EXISTS[#<name>]`: 1 or 0; always 1 for a legal number.
fn exists<'a>(input: Rest<'a>, scope: &impl Scope, depth: u8) -> Read<'a, f64> {
    let (rest, ()) = byte(b'[')(input)?;
    if rest.first() != Some(&b'#') {
        return Err(fault(ErrorKind::ExistsArgument, input, rest));
    }
    let (rest, reference) = reference(rest, scope, depth)?;
    let (rest, ()) = byte(b']')(rest).map_err(|_| fault(ErrorKind::ExprUnclosed, input, rest))?;
    let known = match reference {
        Reference::Number(_) => true,
        Reference::Name(name) => scope.exists(name),
    };
    Ok((rest, if known { 1.0 } else { 0.0 }))
}

fn call(function: Function, x: f64) -> Result<f64, ErrorKind> {
    Ok(match function {
        // -0 stays -0: ATAN tells it from 0 (checked with rs274 2.9).
        Function::Abs => {
            if x < 0.0 {
                -x
            } else {
                x
            }
        }
        Function::Acos if !(-1.0..=1.0).contains(&x) => return Err(ErrorKind::MathAcos { value: x }),
        Function::Acos => functions::acos(x),
        Function::Asin if !(-1.0..=1.0).contains(&x) => return Err(ErrorKind::MathAsin { value: x }),
        Function::Asin => functions::asin(x),
        Function::Cos => functions::cos(x),
        Function::Exp => functions::exp(x),
        Function::Fix => maths::floor(x),
        Function::Fup => maths::ceil(x),
        Function::Ln if x <= 0.0 => return Err(ErrorKind::MathLn { value: x }),
        Function::Ln => functions::ln(x),
        // Never -0: ATAN tells it from 0 (checked with rs274 2.9).
        Function::Round => maths::round(x) + 0.0,
        Function::Sin => functions::sin(x),
        Function::Sqrt if x < 0.0 => return Err(ErrorKind::MathSqrt { value: x }),
        Function::Sqrt => maths::sqrt(x),
        Function::Tan => functions::tan(x),
        Function::Atan | Function::Exists => x, // read by their own functions
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lexer::into_fault;

    struct Table;
    impl Scope for Table {
        fn numbered(&self, index: i32) -> Result<f64, ErrorKind> {
            Ok(f64::from(index) * 10.0)
        }
        fn named(&self, name: &[u8]) -> Option<f64> {
            (name == b"a").then_some(7.0)
        }
        fn tolerance(&self) -> Tolerance {
            Tolerance { equal: 1e-4, ordered: false }
        }
        fn strict(&self) -> bool {
            false
        }
    }

    #[test]
    fn values() {
        for (text, expected) in [
            ("[1+2*3]", 7.0),
            ("[2**3**2]", 64.0),
            ("[-2**2]", 4.0),
            ("[7 mod 3]", 1.0),
            ("[-7mod3]", 2.0),
            ("[-7mod-3]", 2.0),
            ("[1+2eq3and4gt3]", 1.0),
            ("[1or0and0]", 0.0),
            ("[1-2-3]", -4.0),
            ("[[1+2]*[3-4]]", -3.0),
            ("-#1", -10.0),
            ("##1", 100.0),
            ("#[1+1]", 20.0),
            ("#<a>", 7.0),
            ("-sin[30]", -0.5),
            ("atan[1]/[-1]", 135.0),
            ("fix[-2.5]", -3.0),
            ("fup[-2.5]", -2.0),
            ("round[-2.5]", -3.0),
            ("exists[#<b>]", 0.0),
            ("exists[#5]", 1.0),
            ("--1", 1.0),
            ("-+-[1]", 1.0),
            ("[2+3*4**2/8-1]", 7.0),
            ("[1eq1.00009]", 1.0),
        ] {
            let text: std::string::String = text.chars().filter(|c| *c != ' ').collect();
            let (rest, result) = value(text.as_bytes(), &Table).unwrap_or_else(|e| panic!("{text}: {e:?}"));
            assert!(rest.is_empty() && (result - expected).abs() < 1e-12, "{text} = {result}");
        }
    }

    #[test]
    fn faults() {
        for (text, code) in [
            ("[1+2", "expr-unclosed"),
            ("[1foo2]", "expr-operator"),
            ("foo[1]", "expr-function"),
            ("sin1", "expr-bracket"),
            ("sqrt[-1]", "math-domain"),
            ("[1/0]", "math-div0"),
            ("[1mod0]", "math-nan"),
            ("exp[1000]", "math-inf"),
            ("ln[0]", "math-domain"),
            ("#5602", "param-range"),
            ("#0", "param-range"),
            ("#1.5", "not-integer"),
            ("#<b>", "param-undefined"),
            ("#<b", "param-name"),
            ("[-8**0.5]", "math-domain"),
            ("", "bad-number"),
            ("-", "bad-number"),
            ("exists[5]", "expr-bracket"),
            ("atan[1]", "expr-bracket"),
            ("[]", "bad-number"),
        ] {
            let error = value(text.as_bytes(), &Table).expect_err(text);
            assert_eq!(into_fault(error).kind.code(), code, "{text}");
        }
        let deep = [b'['; 250];
        assert_eq!(into_fault(value(&deep, &Table).unwrap_err()).kind.code(), "expr-depth");
        let deep = [b'#'; 250];
        assert_eq!(into_fault(value(&deep, &Table).unwrap_err()).kind.code(), "expr-depth");
    }
}
