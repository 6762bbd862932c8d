//! Biovision BVH motion capture: a joint hierarchy and one line of channel values a frame.

use std::path::Path;

use modiste_core::Vec3;

use crate::text::{Line, lines, lossy};
use crate::{IoError, read_bytes};

/// A clip of motion capture, in the units of its file (lengths differ between sources; angles are degrees).
#[derive(Debug, Clone, PartialEq)]
pub struct BvhClip {
    /// Joints, parents before children; the first is the root.
    pub joints: Vec<BvhJoint>,
    /// Time between frames (s).
    pub frame_time: f64,
    /// Values of all channels in one frame (degrees for rotations), one row per frame.
    pub frames: Vec<Vec<f64>>,
}

/// A joint of the hierarchy.
#[derive(Debug, Clone, PartialEq)]
pub struct BvhJoint {
    /// Name, unique in the clip.
    pub name: String,
    /// Index of the parent joint; `None` for the root.
    pub parent: Option<usize>,
    /// Rest position relative to the parent.
    pub offset: Vec3,
    /// What its values in a frame mean; rotations apply in this order, first one outermost.
    pub channels: Vec<Channel>,
    /// Index of its first value in a frame.
    pub first_channel: usize,
    /// Rest position of the tip relative to this joint, where it is a leaf.
    pub end_site: Option<Vec3>,
}

/// Meaning of one value.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Channel {
    /// Translation along X.
    XPosition,
    /// Translation along Y.
    YPosition,
    /// Translation along Z.
    ZPosition,
    /// Rotation about X (degrees).
    XRotation,
    /// Rotation about Y (degrees).
    YRotation,
    /// Rotation about Z (degrees).
    ZRotation,
}

impl Channel {
    fn from_name(name: &str) -> Option<Self> {
        Some(match name.to_ascii_lowercase().as_str() {
            "xposition" => Self::XPosition,
            "yposition" => Self::YPosition,
            "zposition" => Self::ZPosition,
            "xrotation" => Self::XRotation,
            "yrotation" => Self::YRotation,
            "zrotation" => Self::ZRotation,
            _ => return None,
        })
    }
}

impl BvhClip {
    /// The joint of that name.
    pub fn joint(&self, name: &str) -> Option<usize> {
        self.joints.iter().position(|joint| joint.name == name)
    }

    /// Number of values in each frame.
    pub fn channel_count(&self) -> usize {
        self.joints.iter().map(|joint| joint.channels.len()).sum()
    }
}

/// Reads a clip from `.bvh` or `.bvh.gz`.
///
/// # Errors
/// [`IoError`] naming the file and the line.
pub fn read(path: impl AsRef<Path>) -> Result<BvhClip, IoError> {
    let path = path.as_ref();
    parse(&read_bytes(path)?, &path.display().to_string())
}

/// Reads from bytes; `name` stands for the file in errors.
///
/// # Errors
/// [`IoError`] naming the line: bad hierarchy, channels, counts, values, or a clip cut short.
pub fn parse(bytes: &[u8], name: &str) -> Result<BvhClip, IoError> {
    let text = lossy(bytes);
    let mut reader = Reader { lines: lines(&text, name).filter(|line| !line.text.is_empty()), file: name, last: 0 };
    let line = reader.next("HIERARCHY")?;
    if line.text != "HIERARCHY" {
        return Err(line.error("HIERARCHY", line.text));
    }
    let joints = hierarchy(&mut reader)?;
    let channel_count = joints.iter().map(|joint| joint.channels.len()).sum();
    let (frame_count, frame_time) = motion_header(&mut reader)?;
    let frames = (0..frame_count).map(|_| frame(&mut reader, channel_count)).collect::<Result<Vec<_>, _>>()?;
    match reader.lines.next() {
        Some(line) => Err(line.error(&format!("the end after {frame_count} frames"), line.text)),
        None => Ok(BvhClip { joints, frame_time, frames }),
    }
}

/// Lines that hold something, remembering where the file ended.
struct Reader<'a, L> {
    lines: L,
    file: &'a str,
    last: usize,
}

impl<'a, L: Iterator<Item = Line<'a>>> Reader<'a, L> {
    fn next(&mut self, wanted: &str) -> Result<Line<'a>, IoError> {
        let line =
            self.lines.next().ok_or_else(|| IoError::line(self.file, self.last + 1, wanted, "the end of the file"))?;
        self.last = line.number;
        Ok(line)
    }
}

/// What an open bracket belongs to.
enum Block {
    Joint(usize),
    EndSite(usize),
}

fn hierarchy<'a>(reader: &mut Reader<'a, impl Iterator<Item = Line<'a>>>) -> Result<Vec<BvhJoint>, IoError> {
    const DEEPEST: usize = 1000;
    let mut joints: Vec<BvhJoint> = Vec::new();
    let mut seen: Vec<Seen> = Vec::new();
    let mut open: Vec<Block> = Vec::new();
    loop {
        let wanted = if joints.is_empty() { "ROOT and a name" } else { "OFFSET, CHANNELS, JOINT, End Site or }" };
        let line = reader.next(wanted)?;
        let mut words = line.text.split_whitespace();
        match (words.next().unwrap_or_default(), open.last()) {
            ("ROOT", None) if joints.is_empty() => {}
            ("JOINT", Some(Block::Joint(_))) if open.len() < DEEPEST => {}
            ("End", Some(&Block::Joint(joint))) if joints[joint].end_site.is_none() => {
                open_bracket(reader)?;
                open.push(Block::EndSite(joint));
                continue;
            }
            ("OFFSET", Some(&Block::Joint(joint))) if !seen[joint].offset => {
                joints[joint].offset = line.point(&mut words, "OFFSET and three finite numbers")?;
                seen[joint].offset = true;
                continue;
            }
            ("OFFSET", Some(&Block::EndSite(joint))) if joints[joint].end_site.is_none() => {
                joints[joint].end_site = Some(line.point(&mut words, "OFFSET and three finite numbers")?);
                continue;
            }
            ("CHANNELS", Some(&Block::Joint(joint))) if !seen[joint].channels => {
                joints[joint].channels = channels(&line, words)?;
                seen[joint].channels = true;
                continue;
            }
            ("}", Some(block)) => {
                close(&line, block, &joints, &seen)?;
                open.pop();
                if open.is_empty() {
                    break;
                }
                continue;
            }
            _ => return Err(line.error(wanted, line.text)),
        }
        let name = words.collect::<Vec<_>>().join(" ");
        if name.is_empty() || joints.iter().any(|joint| joint.name == name) {
            return Err(line.error("a joint name of its own", line.text));
        }
        let parent = match open.last() {
            Some(&Block::Joint(parent)) => Some(parent),
            _ => None,
        };
        open_bracket(reader)?;
        open.push(Block::Joint(joints.len()));
        seen.push(Seen::default());
        let offset = Vec3::ZERO;
        joints.push(BvhJoint { name, parent, offset, channels: Vec::new(), first_channel: 0, end_site: None });
    }
    // The values of a frame come in the order in which the joints are listed.
    let mut first_channel = 0;
    for joint in &mut joints {
        joint.first_channel = first_channel;
        first_channel += joint.channels.len();
    }
    Ok(joints)
}

/// Which of the lines that a joint must have were there.
#[derive(Default, Clone, Copy)]
struct Seen {
    offset: bool,
    channels: bool,
}

fn open_bracket<'a>(reader: &mut Reader<'a, impl Iterator<Item = Line<'a>>>) -> Result<(), IoError> {
    let line = reader.next("{")?;
    if line.text == "{" { Ok(()) } else { Err(line.error("{", line.text)) }
}

fn close(line: &Line<'_>, block: &Block, joints: &[BvhJoint], seen: &[Seen]) -> Result<(), IoError> {
    let missing = match *block {
        Block::Joint(joint) if !seen[joint].offset => Some((joint, "OFFSET")),
        Block::Joint(joint) if !seen[joint].channels => Some((joint, "CHANNELS")),
        Block::EndSite(joint) if joints[joint].end_site.is_none() => Some((joint, "OFFSET of its End Site")),
        _ => None,
    };
    match missing {
        Some((joint, what)) => Err(line.error(&format!("{what} of joint {} before", joints[joint].name), line.text)),
        None => Ok(()),
    }
}

fn channels<'a>(line: &Line<'a>, mut words: impl Iterator<Item = &'a str>) -> Result<Vec<Channel>, IoError> {
    const WANTED: &str = "CHANNELS, their number (at most 6) and as many different channel names";
    let count: usize = line.whole(words.next().unwrap_or_default(), WANTED)?;
    let mut channels = Vec::new();
    for word in words {
        let channel = Channel::from_name(word).ok_or_else(|| line.error("a channel such as Zrotation", word))?;
        if channels.contains(&channel) {
            return Err(line.error(WANTED, line.text));
        }
        channels.push(channel);
    }
    if channels.len() == count { Ok(channels) } else { Err(line.error(WANTED, line.text)) }
}

fn motion_header<'a>(reader: &mut Reader<'a, impl Iterator<Item = Line<'a>>>) -> Result<(usize, f64), IoError> {
    let line = reader.next("MOTION")?;
    if line.text != "MOTION" {
        return Err(line.error("MOTION", line.text));
    }
    let wanted = "Frames: and a whole number above 0";
    let line = reader.next(wanted)?;
    let count = line.text.strip_prefix("Frames:").ok_or_else(|| line.error(wanted, line.text))?.trim();
    let count: usize = line.whole(count, wanted)?;
    if count == 0 {
        return Err(line.error(wanted, line.text));
    }
    let wanted = "Frame Time: and seconds above 0";
    let line = reader.next(wanted)?;
    let time = line.text.strip_prefix("Frame Time:").ok_or_else(|| line.error(wanted, line.text))?.trim();
    let time = line.finite(time, wanted)?;
    if time > 0.0 { Ok((count, time)) } else { Err(line.error(wanted, line.text)) }
}

fn frame<'a>(
    reader: &mut Reader<'a, impl Iterator<Item = Line<'a>>>,
    channel_count: usize,
) -> Result<Vec<f64>, IoError> {
    let line = reader.next("another frame")?;
    let values = line.text.split_whitespace().map(|word| line.finite(word, "finite numbers"));
    let values = values.collect::<Result<Vec<f64>, _>>()?;
    if values.len() == channel_count {
        return Ok(values);
    }
    Err(IoError::line(line.file, line.number, format!("{channel_count} values"), values.len()))
}

#[cfg(test)]
mod tests {
    use super::{Channel, parse, read};
    use crate::fuzz::survives_damage;
    use modiste_core::Vec3;

    const CLIP: &str = "HIERARCHY\nROOT Hips\n{\n\tOFFSET 0 0 0\n\tCHANNELS 6 Xposition Yposition Zposition Zrotation Yrotation Xrotation \n\tJOINT Leg\n\t{\n\t\tOFFSET 1 -2 .5\n\t\tCHANNELS 3 Zrotation Yrotation Xrotation\n\t\tEnd Site\n\t\t{\n\t\t\tOFFSET 0 -4 0\n\t\t}\n\t}\n\tJOINT Arm\n\t{\n\t\tOFFSET 3 0 0\n\t\tCHANNELS 1 Xrotation\n\t\tEnd Site\n\t\t{\n\t\t\tOFFSET 1 0 0\n\t\t}\n\t}\n}\nMOTION\nFrames:\t2\nFrame Time: .0083333\n1 2 3 4 5 6 7 8 9 10\n-1 -2 -3 -4 -5 -6 -7 -8 -9 -1e1\n\n";

    #[test]
    fn hierarchy_channels_and_frames() {
        for text in [CLIP.to_owned(), CLIP.replace('\n', "\r\n")] {
            let clip = parse(text.as_bytes(), "clip.bvh").unwrap();
            let names: Vec<_> = clip.joints.iter().map(|joint| (joint.name.as_str(), joint.parent)).collect();
            assert_eq!(names, [("Hips", None), ("Leg", Some(0)), ("Arm", Some(0))]);
            assert_eq!(clip.joints[1].offset, Vec3::new(1.0, -2.0, 0.5));
            assert_eq!(clip.joints[1].end_site, Some(Vec3::new(0.0, -4.0, 0.0)));
            assert_eq!(clip.joints.iter().map(|joint| joint.first_channel).collect::<Vec<_>>(), [0, 6, 9]);
            assert_eq!(clip.joints[2].channels, [Channel::XRotation]);
            assert_eq!(clip.channel_count(), 10);
            assert_eq!(clip.frames.len(), 2);
            assert_eq!(clip.frames[1].last(), Some(&-10.0));
            assert!((clip.frame_time - 0.0083333).abs() < 1e-12);
        }
    }

    #[test]
    fn errors_name_the_line() {
        let message = |from: &str, to: &str| parse(CLIP.replacen(from, to, 1).as_bytes(), "c").unwrap_err().to_string();
        assert_eq!(message("1 2 3 4 5 6 7 8 9 10", "1 2 3"), "c, line 28: wanted 10 values, found 3");
        assert!(message("1 2 3", "1 nan 3").starts_with("c, line 28: wanted finite numbers, found \"nan\""));
        assert!(message("Frames:\t2", "Frames:\t3").contains("wanted another frame, found the end of the file"));
        assert!(message("Frames:\t2", "Frames:\t1").starts_with("c, line 29: wanted the end after 1 frames"));
        assert!(message("Frames:\t2", "Frames:\t0").contains("above 0"));
        assert!(message("Frames:\t2", "Frames:\t99999999999999999999").contains("line 26"));
        assert!(message(".0083333", "-1").contains("Frame Time: and seconds above 0"));
        assert!(message("CHANNELS 3", "CHANNELS 4").starts_with("c, line 9: wanted CHANNELS"));
        assert!(message("Zrotation Yrotation Xrotation\n", "Zrotation Zrotation Xrotation\n").contains("different"));
        assert!(message("Zrotation", "Wrotation").contains("found \"Wrotation\""));
        assert!(message("JOINT Arm", "JOINT Leg").contains("a joint name of its own"));
        assert!(message("OFFSET 3 0 0", "OFFSET 3 0").contains("line 17"));
        assert!(message("\t\tOFFSET 3 0 0\n", "").contains("OFFSET of joint Arm"));
        assert!(message("MOTION", "MOTIO").contains("wanted MOTION"));
        assert!(message("HIERARCHY", "").contains("wanted HIERARCHY"));
        assert!(parse(b"", "c").unwrap_err().to_string().starts_with("c, line 1: wanted HIERARCHY"));
    }

    #[test]
    fn damage_never_panics() {
        survives_damage(CLIP.as_bytes(), |bytes| {
            if let Ok(clip) = parse(bytes, "damaged.bvh") {
                assert!(clip.frames.iter().flatten().all(|value| value.is_finite()));
            }
        });
    }

    #[test]
    fn every_clip_of_the_shared_data_reads() {
        let Some(folder) = crate::shared_data("mocap") else { return };
        let clips: Vec<_> = crate::list_folder(folder).unwrap();
        let clips: Vec<_> = clips.iter().filter(|path| path.extension().is_some_and(|ending| ending == "gz")).collect();
        assert_eq!(clips.len(), 35);
        for path in clips {
            let clip = read(path).unwrap();
            assert!(clip.joints.len() > 30 && clip.frames.len() > 100, "{}", path.display());
            assert!((clip.frame_time - 1.0 / 120.0).abs() < 1e-5);
        }
    }
}
