//! Every linked shader through naga, and host structs against the shaders' layouts. No GPU is needed.

use naga::valid::{Capabilities, ValidationFlags, Validator};

use crate::frame::FrameUniforms;
use crate::ranges::{OccupancyTask, RangesTask};
use crate::shaders::Shader;

/// All linked shaders.
const SHADERS: &[Shader] = &[
    crate::raycast::SHADER,
    crate::ranges::RANGES_SHADER,
    crate::ranges::OCCUPANCY_SHADER,
    crate::context::filter::SHADER,
    crate::proxy::CELLS_SHADER,
    crate::proxy::VIEW_SHADER,
    crate::proxy::RANGE_SHADER,
    crate::geometry::SURFACE_SHADER,
    crate::geometry::BEHIND_SHADER,
    crate::frame::FILL_SHADER,
    crate::frame::BLUR_SHADER,
    crate::frame::DIRECTIONS_SHADER,
    crate::clipping::LISTS_SHADER,
    crate::clipping::SWEEP_SHADER,
    crate::clipping::PEEL_SHADER,
    crate::clipping::PEEL_COUNT_SHADER,
    crate::clipping::SWEEP_PEEL_SHADER,
    crate::cells::DRAW_SHADER,
    crate::cells::SELECT_SHADER,
    crate::cells::PROJECT_GRID_SHADER,
    crate::cells::PROJECT_MESH_SHADER,
    crate::cells::SORT_SHADER,
    crate::cells::WIDEN_SHADER,
    crate::cells::TILES_MESH_SHADER,
    crate::cells::TILES_GRID_SHADER,
    crate::cells::TILES_BIN_SHADER,
    crate::cells::TILES_COMPOSITE_SHADER,
    crate::cells::TILES_SHOW_SHADER,
    crate::slices::SHADER,
    crate::slices::DEVELOP_SHADER,
];

fn module(shader: Shader) -> naga::Module {
    let source = shader.linked;
    naga::front::wgsl::parse_str(source).unwrap_or_else(|e| panic!("{}", e.emit_to_string(source)))
}

#[test]
fn every_shader_is_valid() {
    for shader in SHADERS {
        let module = module(*shader);
        let valid = Validator::new(ValidationFlags::all(), Capabilities::default()).validate(&module);
        assert!(valid.is_ok(), "{}: {:?}", shader.path, valid.err());
    }
}

/// Offset and size of every member of a struct, by name.
fn layout(module: &naga::Module, name: &str) -> Vec<(String, u32)> {
    let found = module.types.iter().find(|(_, t)| t.name.as_deref().is_some_and(|n| n.ends_with(name)));
    let (_, found) = found.unwrap_or_else(|| panic!("there is no struct {name}"));
    let naga::TypeInner::Struct { members, .. } = &found.inner else { panic!("{name} is no struct") };
    members.iter().map(|m| (m.name.clone().unwrap_or_default(), m.offset)).collect()
}

fn size(module: &naga::Module, name: &str) -> u32 {
    let found = module.types.iter().find(|(_, t)| t.name.as_deref().is_some_and(|n| n.ends_with(name)));
    match found.map(|(_, t)| &t.inner) {
        Some(naga::TypeInner::Struct { span, .. }) => *span,
        _ => panic!("there is no struct {name}"),
    }
}

/// Holds the fields of a host struct against a shader's, by name and offset.
macro_rules! assert_layout {
    ($module:expr, $name:literal, $host:ty { $($field:ident),* $(,)? }) => {
        let host = vec![$((stringify!($field).to_owned(), std::mem::offset_of!($host, $field) as u32)),*];
        assert_eq!(layout(&$module, $name), host);
        assert_eq!(size(&$module, $name) as usize, size_of::<$host>());
    };
}

#[test]
fn peeled_meshes_match_the_shader() {
    let module = module(crate::clipping::SWEEP_PEEL_SHADER);
    assert_layout!(
        module,
        "PeeledMesh",
        crate::clipping::PeeledMesh {
            leaf,
            entering,
            entering_count,
            leaving,
            leaving_count,
            backmost,
            half,
            reserved,
        }
    );
}

#[test]
fn slices_match_the_shader() {
    let module = module(crate::slices::SHADER);
    assert_layout!(
        module,
        "SliceFrame",
        crate::slices::SliceUniforms {
            clip_from_voxel,
            normal,
            offset,
            narrow_margin,
            spacing,
            wide_margin,
            first_depth,
            sequence,
            last_plane,
            kind,
            length_unit,
        }
    );
    assert_layout!(
        module,
        "Brick",
        crate::slices::BrickRecord { origin, edge, cut, reserved_x, reserved_y, reserved_z }
    );
}

#[test]
fn frame_uniforms_match_the_shader() {
    let module = module(crate::raycast::SHADER);
    assert_layout!(
        module,
        "Frame",
        FrameUniforms {
            point_first,
            step_length,
            point_per_x,
            base_distance,
            point_per_y,
            opaque_below,
            direction_first,
            vanishing,
            direction_per_x,
            ambient,
            direction_per_y,
            diffuse,
            voxel_from_world_x,
            specular,
            voxel_from_world_y,
            specular_power,
            voxel_from_world_z,
            wrap_power,
            gradient_from_texel_x,
            mean_diffuse,
            gradient_from_texel_y,
            mean_specular,
            gradient_from_texel_z,
            iso_opacity,
            light,
            headlight,
            extent,
            parallel,
            table_offset,
            table_scale,
            table_last,
            iso_count,
            blocks,
            block_edge,
            coarse_blocks,
            coarse_edge,
            impregnation_depth,
            impregnation,
            overlay,
            cap,
            resolution,
            bins_offset,
            bins_scale,
            bins_last,
            nodes,
            value_sign,
            adaptive_threshold,
            range_first,
            range_scale,
            per_block_edge,
            per_coarse_edge,
            per_voxels,
            voxels_per_step,
        }
    );
}

#[test]
fn tasks_of_blocks_match_their_shaders() {
    assert_layout!(
        module(crate::ranges::RANGES_SHADER),
        "RangesTask",
        RangesTask {
            dimensions,
            edge,
            blocks,
            first_layer,
            coarse_blocks,
            fine_per_coarse,
            first_texel,
            scale,
            reserved,
        }
    );
    assert_layout!(
        module(crate::ranges::OCCUPANCY_SHADER),
        "OccupancyTask",
        OccupancyTask {
            blocks,
            first_word,
            coarse_blocks,
            fine_per_coarse,
            entry_offset,
            entry_scale,
            entry_last,
            level_count,
            criterion,
            fine_words,
            coarse_words,
            end_word,
        }
    );
}

#[test]
fn proxy_uniforms_match_the_shaders() {
    use crate::proxy::{BuildUniforms, LimitsUniforms, ProxyViewUniforms};
    assert_layout!(
        module(crate::proxy::CELLS_SHADER),
        "Build",
        BuildUniforms {
            blocks,
            blocks_per_unit,
            units,
            units_per_cell,
            cells,
            capacity,
            fitted,
            glued,
            boundary,
            first_slab,
        }
    );
    assert_layout!(
        module(crate::proxy::VIEW_SHADER),
        "ProxyView",
        ProxyViewUniforms {
            clip_from_voxel,
            world_from_voxel_x,
            slack,
            world_from_voxel_y,
            distance_unit,
            world_from_voxel_z,
            rounding,
            margin,
            unit_edge,
            line_color,
            mirrored,
        }
    );
    assert_layout!(
        module(crate::proxy::RANGE_SHADER),
        "Limits",
        LimitsUniforms { distance_unit, slack, opaque, nothing_above, cells, cell_edge }
    );
    assert_layout!(
        module(crate::geometry::SURFACE_SHADER),
        "Paint",
        crate::geometry::PaintUniforms { color, lit, depth_unit, reserved_x, reserved_y, reserved_z }
    );
}

#[test]
fn what_passes_are_told_matches_their_shaders() {
    use crate::frame::{Blur, Fill, Slab};
    assert_layout!(module(crate::frame::FILL_SHADER), "Fill", Fill { spacing, nearest_depths, reserved });
    assert_layout!(module(crate::frame::BLUR_SHADER), "Blur", Blur { along, count, reserved });
    assert_layout!(module(crate::frame::DIRECTIONS_SHADER), "Slab", Slab { first, vanishing, reserved });
}

#[test]
fn clip_objects_match_the_shader() {
    for source in [crate::clipping::LISTS_SHADER, crate::clipping::SWEEP_SHADER] {
        assert_layout!(
            module(source),
            "Leaf",
            crate::clipping::Leaf {
                linear_x,
                kind,
                linear_y,
                eye_winding,
                linear_z,
                inverted,
                first,
                mirrored,
                per_x,
                output,
                per_y,
                bare,
                second,
                reserved_second,
                clip_x,
                clip_y,
                clip_z,
                clip_w,
            }
        );
    }
}

#[test]
fn sweep_settings_match_the_shader() {
    let source = crate::clipping::SWEEP_SHADER;
    assert_layout!(
        module(source),
        "SweepSettings",
        crate::clipping::SweepUniforms {
            first_pixel,
            width,
            leaf_count,
            gate_count,
            keeps_outside,
            tolerance,
            segment_limit,
            backmost,
            segment_capacity,
            reserved,
        }
    );
    let words = format!("const OWN_WORDS = {}u", crate::clipping::OWN_WORDS);
    assert!(source.linked.contains(&words), "the shader holds another number of words than `{words}`");
}

#[test]
fn what_cells_are_told_matches_their_shaders() {
    use crate::cells::{BasisTetrahedron, CellViewUniforms, MeshTask, Piece, SelectTask, SortTask};
    let draw = module(crate::cells::DRAW_SHADER);
    assert_layout!(
        draw,
        "CellView",
        CellViewUniforms {
            x,
            y,
            depth,
            axis,
            inverse,
            least_w,
            eye,
            size,
            value_offset,
            value_scale,
            per_unit,
            piece_last,
            cells_x,
            cells_y,
            cells_z,
            draw_all,
            keeps_behind,
            reserved_y,
        }
    );
    assert_layout!(draw, "Piece", Piece { low, rise, begin, end, inverse, seen });
    assert_layout!(draw, "Basis", BasisTetrahedron { thick, near, far, ring });
    assert_eq!(size(&draw, "Record"), 64);
    assert_layout!(
        module(crate::cells::SELECT_SHADER),
        "SelectTask",
        SelectTask {
            blocks,
            first,
            block_pivot,
            count,
            cell_pivot,
            indices,
            known_edge,
            reserved_x,
            reserved_y,
            reserved_z,
        }
    );
    let mesh = module(crate::cells::PROJECT_MESH_SHADER);
    assert_layout!(mesh, "MeshTask", MeshTask { first, end, depth_least, depth_scale });
    let tiles = [crate::cells::TILES_BIN_SHADER, crate::cells::TILES_COMPOSITE_SHADER];
    for shader in tiles {
        assert_layout!(
            module(shader),
            "TileTask",
            crate::cells::TileTask { first, count, total, runs, run, tiles_x, tiles, window }
        );
    }
    let spans = module(crate::cells::TILES_MESH_SHADER);
    assert_layout!(spans, "MeshSpan", MeshTask { first, end, depth_least, depth_scale });
    assert_layout!(module(crate::cells::SORT_SHADER), "SortTask", SortTask { count, run, shift, runs });
}

/// The value of a constant of a linked shader, from its text: naga drops those without a type of their own.
fn constant(shader: Shader, name: &str) -> f64 {
    let begin = format!("const {name} = ");
    let line = shader.linked.lines().find_map(|line| line.strip_prefix(&begin));
    let line = line.unwrap_or_else(|| panic!("{} has no constant {name}", shader.path));
    let number = line.trim_end_matches(';');
    let value = match number.strip_prefix("0x") {
        Some(digits) => u32::from_str_radix(digits.trim_end_matches('u'), 16).map(f64::from).ok(),
        None => number.trim_end_matches(['u', 'i', 'f']).parse().ok(),
    };
    value.unwrap_or_else(|| panic!("{name} of {} is no number: {line}", shader.path))
}

/// Numbers that the host and shaders hold, or several shaders.
#[test]
fn numbers_that_both_sides_hold_are_equal() {
    use crate::cells::numbers as cells;
    use crate::cells::{
        DRAW_SHADER, PROJECT_MESH_SHADER, SELECT_SHADER, SORT_SHADER, TILES_BIN_SHADER,
        TILES_COMPOSITE_SHADER, TILES_MESH_SHADER,
    };
    let gauss = 0.5 - 0.5 / 3.0f64.sqrt();
    let least_cosine = cutaway_core::clip::Impregnation::LEAST_COSINE;
    let not_drawn = constant(SORT_SHADER, "NOT_DRAWN");
    let numbers = [
        (crate::raycast::SHADER, "GAUSS", gauss),
        (crate::slices::SHADER, "GAUSS", gauss),
        // The ends of a step from its points, in distances of the points.
        (crate::raycast::SHADER, "BEYOND_GAUSS", gauss / (1.0 - 2.0 * gauss)),
        (crate::slices::SHADER, "BEYOND_GAUSS", gauss / (1.0 - 2.0 * gauss)),
        (crate::raycast::SHADER, "LEAST_COSINE", least_cosine),
        (crate::slices::SHADER, "LEAST_COSINE", least_cosine),
        (DRAW_SHADER, "LEAST_COSINE", least_cosine),
        (crate::raycast::SHADER, "NO_DEPTH", crate::frame::NO_DEPTH.into()),
        (crate::slices::DEVELOP_SHADER, "NO_DEPTH", crate::frame::NO_DEPTH.into()),
        (crate::frame::FILL_SHADER, "NO_DEPTH", crate::frame::NO_DEPTH.into()),
        (crate::geometry::BEHIND_SHADER, "NO_DISTANCE", crate::geometry::NO_DISTANCE),
        (TILES_MESH_SHADER, "TEXELS", cells::TEXELS as f64),
        (TILES_MESH_SHADER, "ROW_BITS", f64::from(cells::ROW).log2()),
        (TILES_MESH_SHADER, "TILE", cells::TILE.into()),
        (TILES_COMPOSITE_SHADER, "TILE", cells::TILE.into()),
        (TILES_COMPOSITE_SHADER, "WINDOW", cells::WINDOW.into()),
        (TILES_COMPOSITE_SHADER, "LIST_PARTS", cells::LIST_PARTS.into()),
        (PROJECT_MESH_SHADER, "NOT_DRAWN", not_drawn),
        (TILES_MESH_SHADER, "NOT_DRAWN", not_drawn),
        (DRAW_SHADER, "PSI_SIDE", cells::PSI_SIDE as f64),
        (DRAW_SHADER, "EXPONENTIALS", cells::EXPONENTIALS as f64),
        (DRAW_SHADER, "BINS", cells::BINS.into()),
        (SELECT_SHADER, "OFFSETS", cells::OFFSETS as f64),
        (TILES_BIN_SHADER, "TEXELS", cells::TEXELS as f64),
    ];
    for (shader, name, expected) in numbers {
        let found = constant(shader, name);
        // As far as shaders count: 24 bits.
        assert!((found / expected - 1.0).abs() < 6e-8, "{name} of {}: {found}, not {expected}", shader.path);
    }
}

/// Entry points of a shader by the size of their workgroups along x.
fn workgroups(shader: Shader) -> Vec<u32> {
    module(shader).entry_points.iter().map(|entry| entry.workgroup_size[0]).collect()
}

#[test]
fn runs_of_a_workgroup_are_as_many_as_the_host_counts() {
    use crate::cells::{TILES_BIN_SHADER, TILES_GRID_SHADER, TILES_MESH_SHADER, numbers::RUNS_OF_GROUP};
    for shader in [TILES_BIN_SHADER, TILES_GRID_SHADER, TILES_MESH_SHADER] {
        assert!(workgroups(shader).contains(&RUNS_OF_GROUP), "{}", shader.path);
    }
}

#[test]
fn light_between_gauss_points_is_extrapolated_alike_and_never_below_none() {
    for shader in [crate::raycast::SHADER, crate::slices::SHADER] {
        let module = module(shader);
        let function = module.functions.iter().find(|(_, f)| f.name.as_deref() == Some("extrapolated"));
        let (_, function) = function.unwrap_or_else(|| panic!("{} extrapolates otherwise", shader.path));
        let bounded = function.expressions.iter().filter(|(_, expression)| {
            matches!(expression, naga::Expression::Math { fun: naga::MathFunction::Max, .. })
        });
        assert_eq!(bounded.count(), 2, "{}: a factor and a white", shader.path);
    }
}
