//! Command lines that make no sense, or that the data cannot serve.

use super::{Case, data, usage};

pub(super) const CASES: &[Case] = &[
    usage("juggle", &["unrecognized subcommand 'juggle'"]),
    usage(
        "train good.csv -o out --speed 9",
        &["unexpected argument '--speed'"],
    ),
    usage(
        "train good.csv --add-to good.safetensors --ridge 0.1 -o out",
        &["'--add-to <MODEL>' cannot be used with"],
    ),
    usage(
        "train good.csv --add-to good.safetensors --em -o out",
        &["cannot be used with"],
    ),
    usage("train -o out", &["required", "DEMOS.csv"]),
    usage("train good.csv", &["required", "--output"]),
    usage(
        "train good.csv -o out --basis",
        &["a value is required for '--basis"],
    ),
    usage(
        "train good.csv -o out --basis wavelet:9",
        &["`wavelet` is no basis: gaussian, fourier or bernstein"],
    ),
    usage(
        "train good.csv -o out --basis gaussian:few",
        &["`few` is not a number of functions"],
    ),
    usage(
        "train good.csv -o out --basis gaussian:-1",
        &["`-1` is not a number of functions"],
    ),
    usage(
        "train good.csv -o out --basis gaussian:0",
        &["at least one function"],
    ),
    usage(
        "train good.csv -o out --basis fourier:4",
        &["its count must be odd, not 4"],
    ),
    usage(
        "train good.csv -o out --basis gaussian:1000000000",
        &["at most 200 functions"],
    ),
    usage(
        "train good.csv -o out --dofs x,x",
        &["--dofs names a column twice"],
    ),
    usage(
        "train good.csv -o out --dofs x,,k",
        &["give NAME, NAME:UNIT or NAME:UNIT:log"],
    ),
    usage(
        "train good.csv -o out --dofs k:N/m:sqrt",
        &["`sqrt` is no transform: `log` is the only one"],
    ),
    usage("train good.csv -o out --ridge 0", &["`0` is not above 0"]),
    usage(
        "train good.csv -o out --ridge NaN",
        &["`NaN` is not a finite number"],
    ),
    usage(
        "train good.csv -o out --ridge much",
        &["`much` is not a finite number"],
    ),
    usage(
        "train good.csv -o out --placement-m=-1",
        &["`-1` is below 0"],
    ),
    data(
        "train good.csv -o out --dofs x --ridge 1e-300",
        &["the ridge is", "at least 1e-12"],
    ),
    data(
        "train good.csv -o nowhere/model --dofs x",
        &["nowhere/model: cannot be written"],
    ),
    data(
        "train good.csv -o folder.csv --dofs x",
        &["folder.csv: cannot be written"],
    ),
    usage("eval good.safetensors", &["required", "DEMOS.csv"]),
    usage(
        "eval good.safetensors good.csv --fraction 0",
        &["`0` is not above 0"],
    ),
    usage(
        "eval good.safetensors good.csv --fraction 1.5",
        &["`1.5` is above 1"],
    ),
    usage(
        "eval good.safetensors good.csv --fraction inf",
        &["`inf` is not a finite number"],
    ),
    usage(
        "eval good.safetensors good.csv --observations 0",
        &["0 is not in 1..=10000"],
    ),
    usage(
        "eval good.safetensors good.csv --observations 1e3",
        &["invalid digit"],
    ),
    usage(
        "eval good.safetensors good.csv --noise-m=-0.1",
        &["`-0.1` is below 0"],
    ),
    usage(
        "eval good.safetensors good.csv --sigma-m 0",
        &["`0` is not above 0"],
    ),
    usage(
        "eval good.safetensors good.csv --seed minus",
        &["invalid digit"],
    ),
    usage(
        "infer good.safetensors -o out",
        &["required", "--label", "--recognise"],
    ),
    usage(
        "infer good.safetensors -o out --label lift --recognise",
        &["cannot be used with"],
    ),
    usage(
        "infer good.safetensors -o out --label lift --at 0.5",
        &["as many --at as --observe"],
    ),
    usage(
        "infer good.safetensors -o out --recognise",
        &["--recognise needs at least one --at"],
    ),
    usage(
        "infer good.safetensors -o out --label lift --at 1.5 --observe x=1",
        &["`1.5` is no phase"],
    ),
    usage(
        "infer good.safetensors -o out --label lift --at nan --observe x=1",
        &["`nan` is not a finite number"],
    ),
    usage(
        "infer good.safetensors -o out --label lift --at 0.5 --observe x",
        &["`x` is not NAME=VALUE"],
    ),
    usage(
        "infer good.safetensors -o out --label lift --at 0.5 --observe x=one",
        &["`one` is not a finite number"],
    ),
    usage(
        "infer good.safetensors -o out --label lift --at 0.5 --observe x=1 --sigma 0",
        &["`0` is not above 0"],
    ),
    data(
        "infer good.safetensors -o out --label jump",
        &["no skill `jump`; present: lift, push"],
    ),
    data(
        "infer good.safetensors -o out --label lift --at 0.5 --observe y=1",
        &["no DoF `y`; present: x"],
    ),
    data(
        "infer good.safetensors -o out --label lift --at 0.5 --observe x=1e308 --sigma 1e-200",
        &["--observe x=1e308"],
    ),
    data(
        "infer good.safetensors -o nowhere/out --label lift",
        &["nowhere/out: cannot be written"],
    ),
    usage("info", &["required", "FILE"]),
];
