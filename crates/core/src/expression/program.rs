//! Formulas compiled to short register programs, which run on packs of numbers.

use std::collections::HashMap;

use super::graph::{FormulaNode, Graph, NodeId};
use crate::scalar::Scalar;

/// Number of registers of a short program: few, because all are cleared at its start.
const FEW: usize = 16;

/// Number of registers of any other program; a power of two, as `FEW` is.
const MOST: usize = 128;

/// Compiled program that evaluates several formulas at once, from inputs in the first registers.
#[derive(Clone, Debug)]
pub(crate) struct Program {
    instructions: Box<[Instruction]>,
    /// Registers of the results.
    outputs: Box<[u8]>,
    registers: usize,
}

/// One operation: `k` is a number, the others are registers.
#[derive(Clone, Copy, Debug)]
struct Instruction {
    k: f64,
    code: Code,
    to: u8,
    from: [u8; 4],
}

#[derive(Clone, Copy, Debug)]
enum Code {
    /// `k`
    Number,
    /// `-a`
    Negate,
    /// `a + b`
    Add,
    /// `a + k`
    Shift,
    /// `a - b`
    Subtract,
    /// `k - a`
    SubtractFrom,
    /// `a b`
    Multiply,
    /// `k a`
    Scale,
    /// `a / b`
    Divide,
    /// `k / a`
    DivideInto,
    /// `a b + c`
    MultiplyAdd,
    /// `a b - c`
    MultiplySubtract,
    /// `c - a b`
    SubtractProduct,
    /// `a b + k`
    MultiplyShift,
    /// `k a + b`
    ScaleAdd,
    Root,
    Logarithm,
    Exponential,
    Magnitude,
    /// `a > 0 ? a : NaN`
    Positive,
    /// `a < b ? c : d`
    IfLess,
}

impl Program {
    /// Compiles `roots`; variable `i` is input `i`, unless `definitions` replaces it.
    ///
    /// # Errors
    /// The number of registers needed and the number available, if these are too few.
    pub(crate) fn new(
        graph: &Graph,
        roots: &[NodeId],
        definitions: &HashMap<u16, NodeId>,
        inputs: usize,
    ) -> Result<Program, [usize; 2]> {
        let (graph, roots) = graph.lowered(roots, definitions);
        Compiler::new(&graph, &roots, inputs).program()
    }

    /// Runs on `inputs` and writes one number per root.
    #[inline(always)]
    pub(crate) fn run<S: Scalar>(&self, inputs: &[S], outputs: &mut [S]) {
        if self.registers <= FEW {
            self.run_in::<S, FEW>(inputs, outputs);
        } else {
            self.run_in::<S, MOST>(inputs, outputs);
        }
    }

    #[inline(always)]
    fn run_in<S: Scalar, const R: usize>(&self, inputs: &[S], outputs: &mut [S]) {
        let mut registers = [S::zero(); R];
        for (register, input) in registers.iter_mut().zip(inputs) {
            *register = *input;
        }
        for instruction in &self.instructions {
            // The mask changes nothing: it removes the bounds check.
            let [a, b, c, d] = instruction.from.map(|from| usize::from(from) & (R - 1));
            let (a, b) = (registers[a], registers[b]);
            let k = S::splat(instruction.k);
            registers[usize::from(instruction.to) & (R - 1)] = match instruction.code {
                Code::Number => k,
                Code::Negate => -a,
                Code::Add => a + b,
                Code::Shift => a + k,
                Code::Subtract => a - b,
                Code::SubtractFrom => k - a,
                Code::Multiply => a * b,
                Code::Scale => k * a,
                Code::Divide => a / b,
                Code::DivideInto => k / a,
                Code::MultiplyAdd => a.mul_add(b, registers[c]),
                Code::MultiplySubtract => a.mul_add(b, -registers[c]),
                Code::SubtractProduct => (-a).mul_add(b, registers[c]),
                Code::MultiplyShift => a.mul_add(b, k),
                Code::ScaleAdd => k.mul_add(a, b),
                Code::Root => a.sqrt(),
                Code::Logarithm => a.ln(),
                Code::Exponential => a.exp(),
                Code::Magnitude => a.abs(),
                Code::Positive => S::select(S::zero().lt(a), a, S::splat(f64::NAN) * a),
                Code::IfLess => S::select(a.lt(b), registers[c], registers[d]),
            };
        }
        for (output, from) in outputs.iter_mut().zip(&self.outputs) {
            *output = registers[usize::from(*from) & (R - 1)];
        }
    }
}

/// Translation of a node.
#[derive(Clone, Copy, Debug)]
enum Fate {
    /// The node is an input, or its value needs no register.
    Nothing,
    Computed {
        code: Code,
        k: f64,
        operands: [NodeId; 4],
        count: usize,
    },
}

struct Compiler<'g> {
    graph: &'g Graph,
    roots: &'g [NodeId],
    inputs: usize,
    /// Number of uses of each node.
    uses: Vec<usize>,
    is_root: Vec<bool>,
}

impl<'g> Compiler<'g> {
    fn new(graph: &'g Graph, roots: &'g [NodeId], inputs: usize) -> Self {
        let reached = graph.reached(roots);
        let mut uses = vec![0; reached.len()];
        let mut is_root = vec![false; reached.len()];
        for root in roots {
            is_root[root.index()] = true;
        }
        for id in (0..reached.len()).filter(|index| reached[*index]).map(NodeId::new) {
            graph.node(id).operands().for_each(|operand| uses[operand.index()] += 1);
        }
        Compiler { graph, roots, inputs, uses, is_root }
    }

    /// Factors of a product that is used once, by a sum.
    fn fused(&self, id: NodeId) -> Option<[NodeId; 2]> {
        match self.graph.node(id) {
            FormulaNode::Product(a, b) if self.uses[id.index()] == 1 && !self.is_root[id.index()] => {
                Some([a, b])
            }
            _ => None,
        }
    }

    /// Chooses the operation that computes a node.
    fn fate(&self, id: NodeId) -> Fate {
        let constant = |id: NodeId| self.graph.constant(id);
        let one = |code, a: NodeId, k| Fate::Computed { code, k, operands: [a; 4], count: 1 };
        let two = |code, a, b, k| Fate::Computed { code, k, operands: [a, b, a, a], count: 2 };
        let three = |code, a, b, c| Fate::Computed { code, k: 0.0, operands: [a, b, c, a], count: 3 };
        match self.graph.node(id) {
            FormulaNode::Variable(_) => Fate::Nothing,
            FormulaNode::Number(bits) => {
                Fate::Computed { code: Code::Number, k: f64::from_bits(bits), operands: [id; 4], count: 0 }
            }
            FormulaNode::Negative(a) => one(Code::Negate, a, 0.0),
            FormulaNode::Root(a) => one(Code::Root, a, 0.0),
            FormulaNode::Logarithm(a) => one(Code::Logarithm, a, 0.0),
            FormulaNode::Exponential(a) => one(Code::Exponential, a, 0.0),
            FormulaNode::Magnitude(a) => one(Code::Magnitude, a, 0.0),
            FormulaNode::Positive(a) => one(Code::Positive, a, 0.0),
            FormulaNode::Sum(a, b) => match (constant(a), self.fused(a), self.fused(b)) {
                (Some(k), _, Some([c, d])) if constant(c).is_none() => two(Code::MultiplyShift, c, d, k),
                (Some(k), ..) => one(Code::Shift, b, k),
                (_, Some([c, d]), _) => match constant(c) {
                    Some(k) => two(Code::ScaleAdd, d, b, k),
                    None => three(Code::MultiplyAdd, c, d, b),
                },
                (.., Some([c, d])) => match constant(c) {
                    Some(k) => two(Code::ScaleAdd, d, a, k),
                    None => three(Code::MultiplyAdd, c, d, a),
                },
                _ => two(Code::Add, a, b, 0.0),
            },
            FormulaNode::Difference(a, b) => match (constant(a), self.fused(a), self.fused(b)) {
                (Some(k), ..) => one(Code::SubtractFrom, b, k),
                (.., Some([c, d])) => match constant(c) {
                    Some(k) => two(Code::ScaleAdd, d, a, -k),
                    None => three(Code::SubtractProduct, c, d, a),
                },
                (_, Some([c, d]), _) if constant(c).is_none() => three(Code::MultiplySubtract, c, d, b),
                _ => two(Code::Subtract, a, b, 0.0),
            },
            FormulaNode::Product(a, b) => match constant(a) {
                Some(k) => one(Code::Scale, b, k),
                None => two(Code::Multiply, a, b, 0.0),
            },
            FormulaNode::Quotient(a, b) => match constant(a) {
                Some(k) => one(Code::DivideInto, b, k),
                None => two(Code::Divide, a, b, 0.0),
            },
            FormulaNode::IfLess(operands) => {
                Fate::Computed { code: Code::IfLess, k: 0.0, operands, count: 4 }
            }
            FormulaNode::Power(..) => unreachable!("lowered graphs have no powers"),
        }
    }

    fn program(self) -> Result<Program, [usize; 2]> {
        let fates: Vec<Fate> = (0..self.uses.len()).map(|index| self.fate(NodeId::new(index))).collect();
        // Last use of each value in a register, found from the end. A product fused into a sum and a
        // constant inside of an instruction need no register.
        let mut last_use: Vec<Option<usize>> = vec![None; fates.len()];
        for root in self.roots {
            last_use[root.index()] = Some(usize::MAX);
        }
        for index in (0..fates.len()).rev() {
            if let (Some(_), Fate::Computed { operands, count, .. }) = (last_use[index], fates[index]) {
                for operand in &operands[..count] {
                    last_use[operand.index()].get_or_insert(index);
                }
            }
        }
        // Registers of the inputs; those that nothing needs are free.
        let mut places: Vec<usize> = vec![0; fates.len()];
        let mut free: Vec<usize> = Vec::new();
        let mut registers = self.inputs;
        for input in 0..self.inputs {
            match self.graph.find_variable(input as u16) {
                Some(id) if last_use.get(id.index()).is_some_and(Option::is_some) => {
                    places[id.index()] = input;
                }
                _ => free.push(input),
            }
        }
        // Instructions in order of the nodes: operands at their last use free their registers.
        let mut instructions = Vec::new();
        for (index, fate) in fates.iter().enumerate() {
            let (Some(_), Fate::Computed { code, k, operands, count }) = (last_use[index], *fate) else {
                continue;
            };
            let from = operands.map(|operand| places[operand.index()]);
            for operand in 0..count {
                let is_first = !operands[..operand].contains(&operands[operand]);
                if is_first && last_use[operands[operand].index()] == Some(index) {
                    free.push(from[operand]);
                }
            }
            let to = free.pop().unwrap_or_else(|| {
                registers += 1;
                registers - 1
            });
            places[index] = to;
            let mut used = [0; 4];
            used[..count].copy_from_slice(&from[..count]);
            instructions.push((code, k, to, used));
        }
        if registers > MOST {
            return Err([registers, MOST]);
        }
        let narrow = |register: usize| register as u8;
        let instructions = instructions
            .into_iter()
            .map(|(code, k, to, from)| Instruction { k, code, to: narrow(to), from: from.map(narrow) })
            .collect();
        let outputs = self.roots.iter().map(|root| narrow(places[root.index()])).collect();
        Ok(Program { instructions, outputs, registers })
    }
}
