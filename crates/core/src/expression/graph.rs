//! Expression graph of a formula: common subexpressions merged, constants folded, with exact derivatives.

use std::collections::HashMap;

/// Index of a node of a [`Graph`]; operands have smaller indices.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub(crate) struct NodeId(u32);

impl NodeId {
    pub(super) fn new(index: usize) -> NodeId {
        NodeId(u32::try_from(index).expect("fewer nodes than a text has letters, squared"))
    }

    pub(super) fn index(self) -> usize {
        self.0 as usize
    }
}

/// Operation of a node and its operands. Numbers are stored by their bits, so that nodes can be compared.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(super) enum FormulaNode {
    Number(u64),
    Variable(u16),
    Negative(NodeId),
    Sum(NodeId, NodeId),
    Difference(NodeId, NodeId),
    Product(NodeId, NodeId),
    Quotient(NodeId, NodeId),
    Root(NodeId),
    Logarithm(NodeId),
    Exponential(NodeId),
    /// Operand and constant exponent.
    Power(NodeId, u64),
    Magnitude(NodeId),
    /// The operand if it is positive, else NaN: without it the slope of a logarithm would be defined
    /// where the logarithm is not.
    Positive(NodeId),
    /// `[a, b, then, otherwise]`: `a < b ? then : otherwise`.
    IfLess([NodeId; 4]),
}

impl FormulaNode {
    pub(super) fn operands(self) -> impl DoubleEndedIterator<Item = NodeId> {
        let (operands, count) = match self {
            FormulaNode::Number(_) | FormulaNode::Variable(_) => ([NodeId(0); 4], 0),
            FormulaNode::Negative(a)
            | FormulaNode::Root(a)
            | FormulaNode::Logarithm(a)
            | FormulaNode::Exponential(a)
            | FormulaNode::Power(a, _)
            | FormulaNode::Magnitude(a)
            | FormulaNode::Positive(a) => ([a; 4], 1),
            FormulaNode::Sum(a, b)
            | FormulaNode::Difference(a, b)
            | FormulaNode::Product(a, b)
            | FormulaNode::Quotient(a, b) => ([a, b, a, a], 2),
            FormulaNode::IfLess(operands) => (operands, 4),
        };
        operands.into_iter().take(count).collect::<Vec<_>>().into_iter()
    }
}

/// Nodes, each with earlier nodes as operands. Equal values share one node.
#[derive(Clone, Debug, Default)]
pub(crate) struct Graph {
    nodes: Vec<FormulaNode>,
    ids: HashMap<FormulaNode, NodeId>,
}

impl Graph {
    pub(super) fn node(&self, id: NodeId) -> FormulaNode {
        self.nodes[id.index()]
    }

    fn add(&mut self, node: FormulaNode) -> NodeId {
        if let Some(id) = self.ids.get(&node) {
            return *id;
        }
        let id = NodeId::new(self.nodes.len());
        self.nodes.push(node);
        self.ids.insert(node, id);
        id
    }

    /// Value of a constant node; `None` for any other.
    pub(crate) fn constant(&self, id: NodeId) -> Option<f64> {
        match self.node(id) {
            FormulaNode::Number(bits) => Some(f64::from_bits(bits)),
            _ => None,
        }
    }

    pub(crate) fn number(&mut self, value: f64) -> NodeId {
        self.add(FormulaNode::Number(value.to_bits()))
    }

    pub(crate) fn variable(&mut self, variable: u16) -> NodeId {
        self.add(FormulaNode::Variable(variable))
    }

    pub(crate) fn negative(&mut self, a: NodeId) -> NodeId {
        match self.node(a) {
            FormulaNode::Number(bits) => self.number(-f64::from_bits(bits)),
            FormulaNode::Negative(a) => a,
            FormulaNode::Difference(a, b) => self.difference(b, a),
            FormulaNode::Product(k, x) if let Some(k) = self.constant(k) => {
                let k = self.number(-k);
                self.product(k, x)
            }
            _ => self.add(FormulaNode::Negative(a)),
        }
    }

    pub(crate) fn sum(&mut self, a: NodeId, b: NodeId) -> NodeId {
        match (self.constant(a), self.constant(b)) {
            (Some(a), Some(b)) => return self.number(a + b),
            (Some(0.0), _) => return b,
            (_, Some(0.0)) => return a,
            _ => {}
        }
        match (self.node(a), self.node(b)) {
            (_, FormulaNode::Negative(b)) => self.difference(a, b),
            (FormulaNode::Negative(a), _) => self.difference(b, a),
            _ if a == b => {
                let two = self.number(2.0);
                self.product(two, a)
            }
            // Constants come first, then the earlier node.
            _ if self.constant(b).is_some() || (self.constant(a).is_none() && b < a) => {
                self.add(FormulaNode::Sum(b, a))
            }
            _ => self.add(FormulaNode::Sum(a, b)),
        }
    }

    pub(crate) fn difference(&mut self, a: NodeId, b: NodeId) -> NodeId {
        match (self.constant(a), self.constant(b)) {
            (Some(a), Some(b)) => return self.number(a - b),
            (Some(0.0), _) => return self.negative(b),
            (_, Some(0.0)) => return a,
            (None, Some(b)) => {
                let b = self.number(-b);
                return self.sum(b, a);
            }
            _ => {}
        }
        match self.node(b) {
            _ if a == b => self.number(0.0),
            FormulaNode::Negative(b) => self.sum(a, b),
            _ => self.add(FormulaNode::Difference(a, b)),
        }
    }

    pub(crate) fn product(&mut self, a: NodeId, b: NodeId) -> NodeId {
        let (a, b) = if self.constant(b).is_some() { (b, a) } else { (a, b) };
        match (self.constant(a), self.constant(b)) {
            (Some(a), Some(b)) => return self.number(a * b),
            (Some(0.0), _) => return self.number(0.0),
            (Some(1.0), _) => return b,
            (Some(-1.0), _) => return self.negative(b),
            (Some(k), None) => match self.node(b) {
                FormulaNode::Product(m, x) if let Some(m) = self.constant(m) => {
                    let k = self.number(k * m);
                    return self.product(k, x);
                }
                FormulaNode::Negative(x) => {
                    let k = self.number(-k);
                    return self.product(k, x);
                }
                _ => return self.add(FormulaNode::Product(a, b)),
            },
            _ => {}
        }
        // A constant factor comes in front of all others.
        for (factor, other) in [(a, b), (b, a)] {
            match self.node(factor) {
                FormulaNode::Product(k, x) if self.constant(k).is_some() => {
                    let product = self.product(x, other);
                    return self.product(k, product);
                }
                FormulaNode::Negative(x) => {
                    let product = self.product(x, other);
                    return self.negative(product);
                }
                _ => {}
            }
        }
        if a == b {
            return self.power(a, 2.0);
        }
        let (a, b) = if b < a { (b, a) } else { (a, b) };
        self.add(FormulaNode::Product(a, b))
    }

    pub(crate) fn quotient(&mut self, a: NodeId, b: NodeId) -> NodeId {
        match (self.constant(a), self.constant(b)) {
            (Some(a), Some(b)) => self.number(a / b),
            (Some(0.0), _) => a,
            (None, Some(b)) => {
                let reciprocal = self.number(1.0 / b);
                self.product(reciprocal, a)
            }
            _ => self.add(FormulaNode::Quotient(a, b)),
        }
    }

    pub(crate) fn root(&mut self, a: NodeId) -> NodeId {
        match self.constant(a) {
            Some(a) => self.number(a.sqrt()),
            None => self.add(FormulaNode::Root(a)),
        }
    }

    pub(crate) fn logarithm(&mut self, a: NodeId) -> NodeId {
        match self.constant(a) {
            Some(a) => self.number(libm::log(a)),
            None => self.add(FormulaNode::Logarithm(a)),
        }
    }

    pub(crate) fn exponential(&mut self, a: NodeId) -> NodeId {
        match self.constant(a) {
            Some(a) => self.number(libm::exp(a)),
            None => self.add(FormulaNode::Exponential(a)),
        }
    }

    pub(crate) fn magnitude(&mut self, a: NodeId) -> NodeId {
        match self.constant(a) {
            Some(a) => self.number(a.abs()),
            None => self.add(FormulaNode::Magnitude(a)),
        }
    }

    fn positive(&mut self, a: NodeId) -> NodeId {
        match self.constant(a) {
            Some(a) => self.number(if a > 0.0 { a } else { f64::NAN }),
            None => self.add(FormulaNode::Positive(a)),
        }
    }

    pub(crate) fn power(&mut self, a: NodeId, exponent: f64) -> NodeId {
        match (self.constant(a), self.node(a)) {
            (Some(a), _) => self.number(libm::pow(a, exponent)),
            _ if exponent == 0.0 => self.number(1.0),
            _ if exponent == 1.0 => a,
            // For a non-integer exponent, (a^m)^n can be |a|^(m n).
            (_, FormulaNode::Power(b, inner))
                if exponent.fract() == 0.0 && f64::from_bits(inner).fract() == 0.0 =>
            {
                self.power(b, exponent * f64::from_bits(inner))
            }
            _ => self.add(FormulaNode::Power(a, exponent.to_bits())),
        }
    }

    /// `a < b ? then : otherwise`.
    pub(crate) fn if_less(&mut self, a: NodeId, b: NodeId, then: NodeId, otherwise: NodeId) -> NodeId {
        match (self.constant(a), self.constant(b)) {
            _ if then == otherwise => then,
            (Some(a), Some(b)) => {
                if a < b {
                    then
                } else {
                    otherwise
                }
            }
            _ => self.add(FormulaNode::IfLess([a, b, then, otherwise])),
        }
    }

    /// `then` if `condition` is not zero, else `otherwise`.
    pub(super) fn choice(&mut self, condition: NodeId, then: NodeId, otherwise: NodeId) -> NodeId {
        if let FormulaNode::IfLess([a, b, holds, fails]) = self.node(condition) {
            match (self.constant(holds), self.constant(fails)) {
                (Some(1.0), Some(0.0)) => return self.if_less(a, b, then, otherwise),
                (Some(0.0), Some(1.0)) => return self.if_less(a, b, otherwise, then),
                _ => {}
            }
        }
        let (zero, size) = (self.number(0.0), self.magnitude(condition));
        self.if_less(zero, size, then, otherwise)
    }

    /// For each node up to `roots`: true if a root depends on it.
    pub(super) fn reached(&self, roots: &[NodeId]) -> Vec<bool> {
        let mut reached = vec![false; roots.iter().map(|root| root.index() + 1).max().unwrap_or(0)];
        for root in roots {
            reached[root.index()] = true;
        }
        for index in (0..reached.len()).rev() {
            if reached[index] {
                self.nodes[index].operands().for_each(|operand| reached[operand.index()] = true);
            }
        }
        reached
    }

    /// The node of a variable, if the graph has one.
    pub(super) fn find_variable(&self, variable: u16) -> Option<NodeId> {
        self.ids.get(&FormulaNode::Variable(variable)).copied()
    }

    /// The variables that `root` depends on, ascending.
    pub(crate) fn variables(&self, root: NodeId) -> Vec<u16> {
        let reached = self.reached(&[root]);
        let nodes = self.nodes.iter().zip(reached).filter(|(_, reached)| *reached);
        let variable = |(node, _): (&FormulaNode, bool)| match node {
            FormulaNode::Variable(variable) => Some(*variable),
            _ => None,
        };
        let mut variables: Vec<u16> = nodes.filter_map(variable).collect();
        variables.sort_unstable();
        variables
    }

    /// Derivative of `root` with respect to a variable. Forward mode: the branch that a comparison
    /// rejects is selected away, not multiplied by zero.
    pub(crate) fn derivative(&mut self, root: NodeId, variable: u16) -> NodeId {
        let zero = self.number(0.0);
        let reached = self.reached(&[root]);
        let mut slopes = vec![zero; reached.len()];
        for index in 0..reached.len() {
            if reached[index] {
                slopes[index] = self.slope(index, variable, &slopes);
            }
        }
        slopes[root.index()]
    }

    /// The derivative of one node, given those of the earlier ones.
    fn slope(&mut self, index: usize, variable: u16, slopes: &[NodeId]) -> NodeId {
        let of = |a: NodeId| slopes[a.index()];
        let this = NodeId::new(index);
        let flat = |graph: &Self, a: NodeId| graph.constant(of(a)) == Some(0.0);
        match self.nodes[index] {
            FormulaNode::Number(_) => self.number(0.0),
            FormulaNode::Variable(other) => self.number(if other == variable { 1.0 } else { 0.0 }),
            node if node.operands().all(|operand| flat(self, operand)) => self.number(0.0),
            FormulaNode::Negative(a) => self.negative(of(a)),
            FormulaNode::Sum(a, b) => self.sum(of(a), of(b)),
            FormulaNode::Difference(a, b) => self.difference(of(a), of(b)),
            FormulaNode::Product(a, b) => {
                let (first, second) = (self.product(of(a), b), self.product(a, of(b)));
                self.sum(first, second)
            }
            // (a' - (a/b) b') / b
            FormulaNode::Quotient(a, b) => {
                let lost = self.product(this, of(b));
                let rest = self.difference(of(a), lost);
                self.quotient(rest, b)
            }
            FormulaNode::Root(a) => {
                let half = self.number(0.5);
                let half = self.product(half, of(a));
                self.quotient(half, this)
            }
            FormulaNode::Logarithm(a) => {
                let positive = self.positive(a);
                self.quotient(of(a), positive)
            }
            FormulaNode::Positive(a) => of(a),
            FormulaNode::Exponential(a) => self.product(this, of(a)),
            FormulaNode::Power(a, exponent) => {
                let exponent = f64::from_bits(exponent);
                let power = self.power(a, exponent - 1.0);
                let outer = self.number(exponent);
                let outer = self.product(outer, power);
                self.product(outer, of(a))
            }
            FormulaNode::Magnitude(a) => {
                let zero = self.number(0.0);
                let negative = self.negative(of(a));
                self.if_less(a, zero, negative, of(a))
            }
            FormulaNode::IfLess([a, b, then, otherwise]) => self.if_less(a, b, of(then), of(otherwise)),
        }
    }

    /// Copies `roots` into a new graph without powers, in which each variable of `definitions` is
    /// replaced by its definition.
    pub(super) fn lowered(
        &self,
        roots: &[NodeId],
        definitions: &HashMap<u16, NodeId>,
    ) -> (Graph, Vec<NodeId>) {
        let mut lowered = Graph::default();
        let mut done: HashMap<NodeId, NodeId> = HashMap::new();
        // Depth-first with an explicit stack: operands are copied before the node.
        for root in roots {
            let mut waiting = vec![*root];
            while let Some(id) = waiting.pop() {
                if done.contains_key(&id) {
                    continue;
                }
                let node = self.node(id);
                let stands_for = match node {
                    FormulaNode::Variable(variable) => definitions.get(&variable).copied(),
                    _ => None,
                };
                let missing = |operand: &NodeId| !done.contains_key(operand);
                let needed: Vec<NodeId> = node.operands().chain(stands_for).filter(missing).collect();
                if !needed.is_empty() {
                    waiting.push(id);
                    waiting.extend(needed.into_iter().rev());
                    continue;
                }
                let of = |a: NodeId| done[&a];
                let new = match (node, stands_for) {
                    (_, Some(definition)) => of(definition),
                    (FormulaNode::Number(bits), _) => lowered.number(f64::from_bits(bits)),
                    (FormulaNode::Variable(variable), _) => lowered.variable(variable),
                    (FormulaNode::Negative(a), _) => lowered.negative(of(a)),
                    (FormulaNode::Sum(a, b), _) => lowered.sum(of(a), of(b)),
                    (FormulaNode::Difference(a, b), _) => lowered.difference(of(a), of(b)),
                    (FormulaNode::Product(a, b), _) => lowered.factor(of(a), of(b)),
                    (FormulaNode::Quotient(a, b), _) => lowered.quotient(of(a), of(b)),
                    (FormulaNode::Root(a), _) => lowered.root(of(a)),
                    (FormulaNode::Logarithm(a), _) => lowered.logarithm(of(a)),
                    (FormulaNode::Exponential(a), _) => lowered.exponential(of(a)),
                    (FormulaNode::Magnitude(a), _) => lowered.magnitude(of(a)),
                    (FormulaNode::Positive(a), _) => lowered.positive(of(a)),
                    (FormulaNode::Power(a, exponent), _) => lowered.raised(of(a), f64::from_bits(exponent)),
                    (FormulaNode::IfLess(all), _) => {
                        let [a, b, then, otherwise] = all.map(of);
                        lowered.if_less(a, b, then, otherwise)
                    }
                };
                done.insert(id, new);
            }
        }
        let roots = roots.iter().map(|root| done[root]).collect();
        (lowered, roots)
    }

    /// Product that does not turn equal factors into a power.
    fn factor(&mut self, a: NodeId, b: NodeId) -> NodeId {
        match a == b && self.constant(a).is_none() {
            true => self.add(FormulaNode::Product(a, a)),
            false => {
                let is_number = self.constant(a).is_some() || self.constant(b).is_some();
                if is_number {
                    self.product(a, b)
                } else {
                    self.add(FormulaNode::Product(a.min(b), a.max(b)))
                }
            }
        }
    }

    /// A power written as products and roots, or by the logarithm and the exponential.
    fn raised(&mut self, a: NodeId, exponent: f64) -> NodeId {
        /// Largest exponent that is written as products: beyond it the logarithm takes fewer operations.
        const MOST: f64 = 64.0;
        let size = exponent.abs();
        if size > MOST || (2.0 * size).fract() != 0.0 {
            let logarithm = self.logarithm(a);
            let exponent = self.number(exponent);
            let exponent = self.product(exponent, logarithm);
            return self.exponential(exponent);
        }
        let mut result = if size.fract() == 0.0 { None } else { Some(self.root(a)) };
        let (mut left, mut square) = (size as u32, a);
        while left > 0 {
            if left % 2 == 1 {
                result = Some(result.map_or(square, |result| self.factor(result, square)));
            }
            left /= 2;
            if left > 0 {
                square = self.factor(square, square);
            }
        }
        let one = self.number(1.0);
        let result = result.unwrap_or(one);
        if exponent < 0.0 { self.quotient(one, result) } else { result }
    }
}
