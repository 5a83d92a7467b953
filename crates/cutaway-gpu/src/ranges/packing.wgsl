// A block's range in a word: least and greatest texel in 65535ths of a range that all are in, the least in the low half.

// Texels are whole numbers of 65535ths but for rounding, as those of 8- and 16-bit voxels are.
override WHOLE_TEXELS: bool = true;

// At the upper end, a 32-bit float is off by up to 1/256 of a 65535th.
const ROUNDING = 1.0 / 64.0;

fn packed_range(in_65535ths: vec2f) -> u32 {
    var ends = in_65535ths;
    if WHOLE_TEXELS {
        ends = round(ends);
    } else {
        // Of the least value itself there is no less, and it is not more than itself.
        let above = select(ceil(ends.y + ROUNDING), 0.0, ends.y <= 0.0);
        ends = vec2f(floor(ends.x - ROUNDING), above);
    }
    let whole = vec2u(clamp(ends, vec2f(0.0), vec2f(65535.0)));
    return whole.x | (whole.y << 16u);
}

// The halves of a range, in 65535ths.
fn range_ends(range: u32) -> vec2u {
    return vec2u(extractBits(range, 0u, 16u), range >> 16u);
}

fn united(a: u32, b: u32) -> u32 {
    let x = range_ends(a);
    let y = range_ends(b);
    return min(x.x, y.x) | (max(x.y, y.y) << 16u);
}
