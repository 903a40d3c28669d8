//! Shaders as bytes: `build.rs` packs what naga parsed, and the page unpacks it. Only the parts of naga's data that our
//! shaders use are listed, because code to read all of it takes more space than the shaders. A shader that uses
//! anything else fails the build, which reads back what it wrote.

use naga::ir::*;
use naga::{Arena, Handle, Range, Span, UniqueArena};
use std::fmt::Debug;
use std::num::NonZeroU32;

/// Packs a shader. Names of variables are left out.
///
/// # Panics
///
/// If the shader uses a part of naga's data that is not listed here.
pub fn pack(mut shader: Module) -> Vec<u8> {
    let of_entries = shader.entry_points.iter_mut().map(|entry| &mut entry.function);
    for function in shader.functions.iter_mut().map(|(_, function)| function).chain(of_entries) {
        function.name = None;
        function.named_expressions.clear();
        function.arguments.iter_mut().for_each(|argument| argument.name = None);
        function.local_variables.iter_mut().for_each(|(_, variable)| variable.name = None);
    }
    let mut bytes = Vec::new();
    shader.write(&mut bytes);
    let again = unpack(&bytes);
    let mut copy = Vec::new();
    again.write(&mut copy);
    assert!(bytes == copy, "a packed shader is read differently");
    bytes
}

/// Unpacks a shader that [`pack`] has packed.
///
/// # Panics
///
/// If the bytes have been packed otherwise.
pub fn unpack(bytes: &[u8]) -> Module {
    Module::read(&mut Reader { bytes, handles: Handles::default() })
}

/// Packed bytes, and the handles of everything read so far.
struct Reader<'a> {
    bytes: &'a [u8],
    handles: Handles,
}

/// The handles of each arena, in the order of their indices. Those of expressions and local variables are of the
/// current function.
#[derive(Default)]
struct Handles {
    types: Vec<Handle<Type>>,
    constants: Vec<Handle<Constant>>,
    globals: Vec<Handle<GlobalVariable>>,
    functions: Vec<Handle<Function>>,
    expressions: Vec<Handle<Expression>>,
    variables: Vec<Handle<LocalVariable>>,
}

/// Data that can be packed.
trait Packed: Sized {
    fn write(&self, to: &mut Vec<u8>);
    fn read(from: &mut Reader) -> Self;
}

/// An element of an arena.
trait Element: Packed {
    fn handles(of: &mut Handles) -> &mut Vec<Handle<Self>>;
}

/// Packs each listed form of a type as its number and fields. A form in brackets serves as a pattern and as an
/// expression.
macro_rules! packed {
    ($($type:ty { $($tag:literal ($($field:ident),*) [$($form:tt)+])+ })+) => {$(
        impl Packed for $type {
            fn write(&self, to: &mut Vec<u8>) {
                match self {
                    $($($form)+ => {
                        to.push($tag);
                        $($field.write(to);)*
                    })+
                    #[allow(unreachable_patterns)]
                    other => cannot_pack(other),
                }
            }

            fn read(from: &mut Reader) -> Self {
                match from.byte() {
                    $($tag => {
                        $(let $field = Packed::read(from);)*
                        $($form)+
                    })+
                    _ => panic!("not a packed shader"),
                }
            }
        }
    )+};
}

fn cannot_pack(part: &dyn Debug) {
    panic!("a packed shader cannot have {part:?}");
}

impl Reader<'_> {
    fn byte(&mut self) -> u8 {
        let (byte, rest) = self.bytes.split_first().expect("a whole shader");
        self.bytes = rest;
        *byte
    }
}

impl Packed for u8 {
    fn write(&self, to: &mut Vec<u8>) {
        to.push(*self);
    }

    fn read(from: &mut Reader) -> u8 {
        from.byte()
    }
}

/// Seven bits per byte, the lowest first.
impl Packed for u32 {
    fn write(&self, to: &mut Vec<u8>) {
        let mut rest = *self;
        while rest >= 128 {
            to.push(rest as u8 | 128);
            rest >>= 7;
        }
        to.push(rest as u8);
    }

    fn read(from: &mut Reader) -> u32 {
        let byte = u32::from(from.byte());
        if byte < 128 { byte } else { byte - 128 + (u32::read(from) << 7) }
    }
}

impl Packed for f32 {
    fn write(&self, to: &mut Vec<u8>) {
        to.extend(self.to_le_bytes());
    }

    fn read(from: &mut Reader) -> f32 {
        f32::from_le_bytes([from.byte(), from.byte(), from.byte(), from.byte()])
    }
}

impl Packed for NonZeroU32 {
    fn write(&self, to: &mut Vec<u8>) {
        self.get().write(to);
    }

    fn read(from: &mut Reader) -> NonZeroU32 {
        NonZeroU32::new(u32::read(from)).expect("a length")
    }
}

impl Packed for String {
    fn write(&self, to: &mut Vec<u8>) {
        self.as_bytes().to_vec().write(to);
    }

    fn read(from: &mut Reader) -> String {
        String::from_utf8(Vec::read(from)).expect("a name")
    }
}

impl<T: Packed> Packed for Option<T> {
    fn write(&self, to: &mut Vec<u8>) {
        self.is_some().write(to);
        self.iter().for_each(|some| some.write(to));
    }

    fn read(from: &mut Reader) -> Option<T> {
        bool::read(from).then(|| T::read(from))
    }
}

impl<T: Packed> Packed for Vec<T> {
    fn write(&self, to: &mut Vec<u8>) {
        (self.len() as u32).write(to);
        self.iter().for_each(|element| element.write(to));
    }

    fn read(from: &mut Reader) -> Vec<T> {
        (0..u32::read(from)).map(|_| T::read(from)).collect()
    }
}

impl<T: Element> Packed for Handle<T> {
    fn write(&self, to: &mut Vec<u8>) {
        (self.index() as u32).write(to);
    }

    fn read(from: &mut Reader) -> Handle<T> {
        let index = u32::read(from) as usize;
        T::handles(&mut from.handles)[index]
    }
}

impl<T: Element> Packed for Range<T> {
    fn write(&self, to: &mut Vec<u8>) {
        let range = self.index_range();
        range.start.write(to);
        (range.end - 1).write(to);
    }

    fn read(from: &mut Reader) -> Range<T> {
        Range::new_from_bounds(Packed::read(from), Packed::read(from))
    }
}

impl<T: Element> Packed for Arena<T> {
    fn write(&self, to: &mut Vec<u8>) {
        (self.len() as u32).write(to);
        self.iter().for_each(|(_, element)| element.write(to));
    }

    fn read(from: &mut Reader) -> Arena<T> {
        let mut arena = Arena::new();
        T::handles(&mut from.handles).clear();
        for _ in 0..u32::read(from) {
            let handle = arena.append(T::read(from), Span::UNDEFINED);
            T::handles(&mut from.handles).push(handle);
        }
        arena
    }
}

impl Packed for UniqueArena<Type> {
    fn write(&self, to: &mut Vec<u8>) {
        (self.len() as u32).write(to);
        self.iter().for_each(|(_, element)| element.write(to));
    }

    fn read(from: &mut Reader) -> UniqueArena<Type> {
        let mut arena = UniqueArena::new();
        for _ in 0..u32::read(from) {
            let handle = arena.insert(Type::read(from), Span::UNDEFINED);
            from.handles.types.push(handle);
        }
        arena
    }
}

impl Packed for Block {
    fn write(&self, to: &mut Vec<u8>) {
        // A parsed shader also emits ranges without an expression.
        let emits_none = |statement: &&Statement| matches!(statement, Statement::Emit(range) if range.index_range().is_empty());
        let statements: Vec<_> = self.iter().filter(|some| !emits_none(some)).collect();
        (statements.len() as u32).write(to);
        statements.iter().for_each(|statement| statement.write(to));
    }

    fn read(from: &mut Reader) -> Block {
        Block::from_vec(Packed::read(from))
    }
}

/// Lists which handles belong to the elements of which arena.
macro_rules! elements {
    ($($type:ty: $handles:ident),+) => {$(
        impl Element for $type {
            fn handles(of: &mut Handles) -> &mut Vec<Handle<$type>> {
                &mut of.$handles
            }
        }
    )+};
}

elements! {
    Type: types,
    Constant: constants,
    GlobalVariable: globals,
    Function: functions,
    Expression: expressions,
    LocalVariable: variables
}

impl Packed for Module {
    fn write(&self, to: &mut Vec<u8>) {
        self.types.write(to);
        self.global_expressions.write(to);
        self.constants.write(to);
        self.global_variables.write(to);
        self.functions.write(to);
        self.entry_points.write(to);
    }

    fn read(from: &mut Reader) -> Module {
        Module {
            types: Packed::read(from),
            global_expressions: Packed::read(from),
            constants: Packed::read(from),
            global_variables: Packed::read(from),
            functions: Packed::read(from),
            entry_points: Packed::read(from),
            ..Module::default()
        }
    }
}

impl Packed for Function {
    fn write(&self, to: &mut Vec<u8>) {
        self.arguments.write(to);
        self.result.write(to);
        self.local_variables.write(to);
        self.expressions.write(to);
        self.local_variables.iter().for_each(|(_, variable)| variable.init.write(to));
        self.body.write(to);
    }

    fn read(from: &mut Reader) -> Function {
        let mut function = Function {
            arguments: Packed::read(from),
            result: Packed::read(from),
            local_variables: Packed::read(from),
            expressions: Packed::read(from),
            ..Function::default()
        };
        // Expressions refer to variables, and these to the expressions that they begin with.
        let variables = function.local_variables.iter_mut();
        variables.for_each(|(_, variable)| variable.init = Packed::read(from));
        function.body = Packed::read(from);
        function
    }
}

/// Without the expression that it begins with; see `Function`.
impl Packed for LocalVariable {
    fn write(&self, to: &mut Vec<u8>) {
        self.ty.write(to);
    }

    fn read(from: &mut Reader) -> LocalVariable {
        LocalVariable { name: None, ty: Packed::read(from), init: None }
    }
}

impl Packed for MemoryDecorations {
    fn write(&self, _: &mut Vec<u8>) {
        assert!(self.is_empty(), "a packed shader cannot have {self:?}");
    }

    fn read(_: &mut Reader) -> MemoryDecorations {
        MemoryDecorations::empty()
    }
}

packed! {
    bool {
        0 () [false]
        1 () [true]
    }

    Constant { 0 (name, ty, init) [Constant { name, ty, init }] }

    GlobalVariable {
        0 (name, space, binding, ty, memory_decorations) [GlobalVariable {
            name,
            space,
            binding,
            ty,
            init: None,
            memory_decorations,
        }]
    }

    EntryPoint {
        0 (name, stage, function) [EntryPoint {
            name,
            stage,
            early_depth_test: None,
            workgroup_size: [0, 0, 0],
            workgroup_size_overrides: None,
            function,
            mesh_info: None,
            task_payload: None,
            incoming_ray_payload: None,
        }]
    }

    FunctionArgument { 0 (ty, binding) [FunctionArgument { name: None, ty, binding }] }

    FunctionResult { 0 (ty, binding) [FunctionResult { ty, binding }] }

    ResourceBinding { 0 (group, binding) [ResourceBinding { group, binding }] }

    AddressSpace {
        0 () [AddressSpace::Uniform]
        1 () [AddressSpace::Handle]
    }

    ShaderStage {
        0 () [ShaderStage::Vertex]
        1 () [ShaderStage::Fragment]
    }

    Type { 0 (name, inner) [Type { name, inner }] }

    TypeInner {
        0 (scalar) [TypeInner::Scalar(scalar)]
        1 (size, scalar) [TypeInner::Vector { size, scalar }]
        2 (base, length, stride) [TypeInner::Array { base, size: ArraySize::Constant(length), stride }]
        3 (members, span) [TypeInner::Struct { members, span }]
        4 () [TypeInner::Image {
            dim: ImageDimension::D2,
            arrayed: false,
            class: ImageClass::Sampled { kind: ScalarKind::Float, multi: false },
        }]
        5 () [TypeInner::Sampler { comparison: false }]
    }

    Scalar { 0 (kind, width) [Scalar { kind, width }] }

    ScalarKind {
        0 () [ScalarKind::Float]
        1 () [ScalarKind::Uint]
        2 () [ScalarKind::Sint]
        3 () [ScalarKind::Bool]
    }

    VectorSize {
        0 () [VectorSize::Bi]
        1 () [VectorSize::Tri]
        2 () [VectorSize::Quad]
    }

    StructMember { 0 (name, ty, binding, offset) [StructMember { name, ty, binding, offset }] }

    Binding {
        0 () [Binding::BuiltIn(BuiltIn::VertexIndex)]
        1 () [Binding::BuiltIn(BuiltIn::Position { invariant: false })]
        2 (location, interpolation, sampling) [Binding::Location {
            location,
            interpolation,
            sampling,
            blend_src: None,
            per_primitive: false,
        }]
    }

    Interpolation {
        0 () [Interpolation::Perspective]
        1 () [Interpolation::Flat]
    }

    Sampling {
        0 () [Sampling::Center]
        1 () [Sampling::Either]
    }

    Literal {
        0 (value) [Literal::F32(value)]
        1 (value) [Literal::U32(value)]
        2 (value) [Literal::Bool(value)]
    }

    Expression {
        0 (value) [Expression::Literal(value)]
        1 (constant) [Expression::Constant(constant)]
        2 (ty, components) [Expression::Compose { ty, components }]
        3 (base, index) [Expression::AccessIndex { base, index }]
        4 (size, value) [Expression::Splat { size, value }]
        5 (size, vector, x, y, z, w) [Expression::Swizzle { size, vector, pattern: [x, y, z, w] }]
        6 (index) [Expression::FunctionArgument(index)]
        7 (variable) [Expression::GlobalVariable(variable)]
        8 (variable) [Expression::LocalVariable(variable)]
        9 (pointer) [Expression::Load { pointer }]
        10 (image, sampler, coordinate, level) [Expression::ImageSample {
            image,
            sampler,
            gather: None,
            coordinate,
            array_index: None,
            offset: None,
            level: SampleLevel::Exact(level),
            depth_ref: None,
            clamp_to_edge: false,
        }]
        11 (op, expr) [Expression::Unary { op, expr }]
        12 (op, left, right) [Expression::Binary { op, left, right }]
        13 (condition, accept, reject) [Expression::Select { condition, accept, reject }]
        14 (fun, arg, arg1, arg2) [Expression::Math { fun, arg, arg1, arg2, arg3: None }]
        15 (expr, kind, convert) [Expression::As { expr, kind, convert }]
        16 (function) [Expression::CallResult(function)]
    }

    SwizzleComponent {
        0 () [SwizzleComponent::X]
        1 () [SwizzleComponent::Y]
        2 () [SwizzleComponent::Z]
        3 () [SwizzleComponent::W]
    }

    UnaryOperator {
        0 () [UnaryOperator::Negate]
        1 () [UnaryOperator::LogicalNot]
    }

    BinaryOperator {
        0 () [BinaryOperator::Add]
        1 () [BinaryOperator::Subtract]
        2 () [BinaryOperator::Multiply]
        3 () [BinaryOperator::Divide]
        4 () [BinaryOperator::Equal]
        5 () [BinaryOperator::NotEqual]
        6 () [BinaryOperator::Less]
        7 () [BinaryOperator::LessEqual]
        8 () [BinaryOperator::Greater]
        9 () [BinaryOperator::GreaterEqual]
        10 () [BinaryOperator::And]
        11 () [BinaryOperator::ShiftLeft]
        12 () [BinaryOperator::ShiftRight]
    }

    MathFunction {
        0 () [MathFunction::Abs]
        1 () [MathFunction::Min]
        2 () [MathFunction::Max]
        3 () [MathFunction::Clamp]
        4 () [MathFunction::Mix]
        5 () [MathFunction::SmoothStep]
        6 () [MathFunction::Dot]
        7 () [MathFunction::Length]
        8 () [MathFunction::Fract]
        9 () [MathFunction::Floor]
        10 () [MathFunction::Round]
        11 () [MathFunction::Sign]
        12 () [MathFunction::Sqrt]
        13 () [MathFunction::Exp]
        14 () [MathFunction::Cos]
        15 () [MathFunction::Sin]
    }

    Statement {
        0 (expressions) [Statement::Emit(expressions)]
        1 (block) [Statement::Block(block)]
        2 (condition, accept, reject) [Statement::If { condition, accept, reject }]
        3 (selector, cases) [Statement::Switch { selector, cases }]
        4 () [Statement::Break]
        5 (value) [Statement::Return { value }]
        6 (pointer, value) [Statement::Store { pointer, value }]
        7 (function, arguments, result) [Statement::Call { function, arguments, result }]
    }

    SwitchCase { 0 (value, body, fall_through) [SwitchCase { value, body, fall_through }] }

    SwitchValue {
        0 () [SwitchValue::Default]
        1 (value) [SwitchValue::U32(value)]
    }
}
