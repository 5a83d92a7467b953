//! `cutaway convert`: a mesh in another format, closed or as it is; spline patches as triangles; transfer functions.

use anyhow::Context;
use cutaway_io::mesh::{
    MeshFormat, MeshReadOptions, MeshSpace, WrittenSpace, read_mesh, recognize, rounding, states_its_space,
    write_mesh,
};
use cutaway_io::patches;
use cutaway_io::transfer_function::{self, FunctionFormat, read_transfer_function, write_transfer_function};
use cutaway_io::volume;
use cutaway_mesh::patches::Tessellation;
use cutaway_mesh::{RepairOptions, TriangleMesh, repair};

use crate::args::ConvertArgs;
use crate::outputs::Outputs;
use crate::report::{Verbosity, wrong_use};

pub(crate) fn run(args: &ConvertArgs) -> anyhow::Result<()> {
    let verbosity = Verbosity::new(args.quiet, false);
    // A damaged function is still none of a mesh where the output is to be one.
    if transfer_function::recognize(&args.input).is_some() || FunctionFormat::of_name(&args.output).is_some()
    {
        return convert_function(args, verbosity);
    }
    refuse_volumes(args)?;
    MeshFormat::to_write(&args.output).map_err(|error| wrong_use(error.to_string()))?;
    let mut outputs = Outputs::default();
    outputs.file("the output", &args.output)?;
    outputs.input(&args.input);
    outputs.check()?;
    let mut options = RepairOptions::default();
    if let Some(tolerance) = args.weld_tolerance {
        if tolerance != 0.0 && !(1e-9..=0.1).contains(&tolerance) {
            return Err(wrong_use(format!("--weld-tolerance is {tolerance}; expected 0, or 1e-9 to 0.1")));
        }
        options.weld_tolerance = tolerance;
    }
    let loaded = load(args, verbosity)?;
    let mesh = if args.repair {
        let repaired = repair(&loaded, &options);
        let repaired = repaired.with_context(|| args.input.display().to_string())?;
        repaired.notices.iter().for_each(|notice| verbosity.notice(&notice.to_string()));
        repaired.mesh.into_mesh()
    } else {
        loaded
    };
    let moved = rounding(&mesh);
    if moved > 0.0 && MeshFormat::to_write(&args.output) == Ok(MeshFormat::Stl) {
        verbosity.notice(&format!(
            "STL files hold 32-bit coordinates: rounding moves vertices by up to {moved:.1e}; write .ply or .obj to keep \
             them in place"
        ));
    }
    Ok(write_mesh(&args.output, &mesh, written_space(args))?)
}

/// The axes of what is written: RAS where those of the input are known.
fn written_space(args: &ConvertArgs) -> WrittenSpace {
    let known = match args.mesh_space.unwrap_or_default() {
        MeshSpace::Ras | MeshSpace::Lps => true,
        MeshSpace::File => states_its_space(&args.input),
    };
    if known { WrittenSpace::Ras } else { WrittenSpace::Unsaid }
}

/// A transfer function in another format.
fn convert_function(args: &ConvertArgs, verbosity: Verbosity) -> anyhow::Result<()> {
    let of_meshes = [
        ("--repair", args.repair),
        ("--weld-tolerance", args.weld_tolerance.is_some()),
        ("--tolerance", args.tolerance.is_some()),
        ("--mesh-space", args.mesh_space.is_some()),
    ];
    if let Some((option, _)) = of_meshes.into_iter().find(|(_, given)| *given) {
        return Err(wrong_use(format!(
            "{option} is for meshes; transfer functions have nothing of the kind"
        )));
    }
    if FunctionFormat::of_name(&args.output).is_none() {
        return Err(wrong_use(format!(
            "{}: {} is a transfer function; expected a name that ends in .json (cutaway), .pv.json (ParaView), .vp or .vp.json (Slicer)",
            args.output.display(),
            args.input.display()
        )));
    }
    let mut outputs = Outputs::default();
    outputs.file("the output", &args.output)?;
    outputs.input(&args.input);
    outputs.check()?;
    let loaded = read_transfer_function(&args.input)?;
    loaded.notices.iter().for_each(|notice| verbosity.notice(notice));
    let notices = write_transfer_function(&args.output, &loaded.value)?;
    notices.iter().for_each(|notice| verbosity.notice(notice));
    Ok(())
}

/// A mesh, or the triangles of spline patches.
fn load(args: &ConvertArgs, verbosity: Verbosity) -> anyhow::Result<TriangleMesh> {
    if !patches::recognize(&args.input) {
        // A file that is not there is not of the wrong kind.
        let missing = args.input.metadata().is_err();
        if !missing && args.tolerance.is_some() {
            return Err(wrong_use(format!(
                "--tolerance is for spline patches; {} is not recognized as any",
                args.input.display()
            )));
        }
        let space = args.mesh_space.unwrap_or_default();
        let loaded = read_mesh(&args.input, &MeshReadOptions { space, ..MeshReadOptions::default() })?;
        loaded.notices.iter().for_each(|notice| verbosity.notice(notice));
        return Ok(loaded.value);
    }
    if args.mesh_space.is_some() {
        let file = args.input.display();
        return Err(wrong_use(format!("--mesh-space is for meshes; {file} holds spline patches")));
    }
    let set = patches::read(&args.input)?;
    let tolerance = args.tolerance.unwrap_or_else(|| set.suggested_tolerance());
    let made = set
        .tessellate(&Tessellation::within(tolerance))
        .map_err(|error| anyhow::anyhow!("{}: {error}", args.input.display()))?;
    made.notices().iter().for_each(|notice| verbosity.notice(notice));
    Ok(made.mesh)
}

/// Says of volumes that they are not converted, before their names are said to be no meshes.
fn refuse_volumes(args: &ConvertArgs) -> anyhow::Result<()> {
    let name = args.input.display();
    let sample = args.input.to_str().is_some_and(|name| name.starts_with("sample:"));
    if sample || recognize(&args.input).is_none() && volume::recognize(&args.input) {
        return Err(wrong_use(format!(
            "{name}: this is a volume; this version of cutaway converts meshes only (.ply, .stl, .obj, .gltf, .glb)"
        )));
    }
    Ok(())
}
