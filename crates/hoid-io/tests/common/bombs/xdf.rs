//! XDF: excessive numbers of channels, samples, strings and streams, jumps in time, nested headers.

use crate::mutations::draw::Draw;

const HEADER: u16 = 2;
const SAMPLES: u16 = 3;
const OFFSET: u16 = 4;

/// Makes a bomb.
pub fn bomb(draw: &mut Draw) -> Vec<u8> {
    let mut file = b"XDF:".to_vec();
    let large = 1_u64 << (10 + draw.below(21));
    let many = 1 << (10 + draw.below(7));
    let kind = *draw.one_of(&["double64", "int8", "string", "float32"]);
    match draw.below(8) {
        // The stated numbers of channels and samples exceed the contents.
        0 => {
            append_chunk(&mut file, HEADER, &stream_header(1, large, kind, "100", ""));
            append_chunk(&mut file, SAMPLES, &samples_chunk(&large.to_le_bytes(), &[0; 64]));
        }
        1 => {
            append_chunk(&mut file, HEADER, &stream_header(1, 2, kind, "100", ""));
            append_chunk(&mut file, SAMPLES, &samples_chunk(&u64::MAX.to_le_bytes(), &[0; 64]));
        }
        // Strings of any length, and empty strings.
        2 => {
            append_chunk(&mut file, HEADER, &stream_header(1, 1, "string", "0", ""));
            let text = [&[0, 8][..], &large.to_le_bytes()].concat();
            append_chunk(&mut file, SAMPLES, &samples_chunk(&1_u64.to_le_bytes(), &text));
        }
        3 => {
            let count = 8 * many;
            append_chunk(&mut file, HEADER, &stream_header(1, 1, "string", "100", ""));
            append_chunk(
                &mut file,
                SAMPLES,
                &samples_chunk(&(count as u64).to_le_bytes(), &[0, 1, 0].repeat(count)),
            );
        }
        // Each sample takes one byte.
        4 => {
            let count = 8 * many;
            append_chunk(&mut file, HEADER, &stream_header(1, 2, "int8", "1e-3", ""));
            append_chunk(
                &mut file,
                SAMPLES,
                &samples_chunk(&(count as u64).to_le_bytes(), &vec![0; 3 * count]),
            );
        }
        // Nested elements.
        5 => {
            let nested = ["<a>".repeat(many), "</a>".repeat(many)].concat();
            append_chunk(&mut file, HEADER, &stream_header(1, 2, kind, "100", &nested));
        }
        6 => {
            (0..many as u32 / 4).for_each(|id| append_chunk(&mut file, HEADER, &stream_header(id, 2, kind, "100", "")))
        }
        // A jump of years between two samples, and the same jump in the clock offsets.
        _ => {
            append_chunk(&mut file, HEADER, &stream_header(1, 2, "int8", "1e6", ""));
            let at = |t: f64| [&[8][..], &t.to_le_bytes(), &[1, 2]].concat();
            let two = [at(0.0), at(0.01), at(large as f64), at(1e300)].concat();
            append_chunk(&mut file, SAMPLES, &samples_chunk(&4_u64.to_le_bytes(), &two));
            for k in 0..many {
                let offset = [
                    &1_u32.to_le_bytes()[..],
                    &(k as f64).to_le_bytes(),
                    &1e300_f64.to_le_bytes(),
                ]
                .concat();
                append_chunk(&mut file, OFFSET, &offset);
            }
        }
    }
    file
}

fn append_chunk(file: &mut Vec<u8>, tag: u16, content: &[u8]) {
    file.push(4);
    file.extend((content.len() as u32 + 2).to_le_bytes());
    file.extend(tag.to_le_bytes());
    file.extend(content);
}

/// A chunk of samples of stream 1, preceded by their number.
fn samples_chunk(count: &[u8; 8], bytes: &[u8]) -> Vec<u8> {
    [&1_u32.to_le_bytes()[..], &[8], count, bytes].concat()
}

fn stream_header(id: u32, channels: u64, kind: &str, hz: &str, more: &str) -> Vec<u8> {
    let text = format!(
        "<info><name>s{id}</name><channel_count>{channels}</channel_count><nominal_srate>{hz}</nominal_srate><channel_format>\
         {kind}</channel_format><desc><channels><channel><label>e</label></channel><channel><label>u</label></channel>\
         </channels>{more}</desc></info>"
    );
    [&id.to_le_bytes()[..], text.as_bytes()].concat()
}
