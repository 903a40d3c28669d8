//! Reads, writes, measures and compares pictures of pages.

use anyhow::{Context, Result, bail};
use std::fs;
use std::path::Path;

/// An image with eight bits per channel and without transparency. Rows start at the top.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Picture {
    /// Width in pixels.
    pub width: u32,
    /// Height in pixels.
    pub height: u32,
    /// The red, green and blue values of each pixel.
    pub rgb: Vec<[u8; 3]>,
}

/// The difference between two pictures of the same size.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Difference {
    /// Mean difference over all channels, 0..=255.
    pub mean: f64,
    /// Largest difference in any channel.
    pub max: u8,
    /// Number of pixels in which any channel differs by more than the tolerance of [`Picture::compare`].
    pub outliers: usize,
}

impl Picture {
    pub fn decode(png: &[u8]) -> Result<Picture> {
        let mut decoder = png::Decoder::new(std::io::Cursor::new(png));
        decoder.set_transformations(png::Transformations::normalize_to_color8());
        let mut reader = decoder.read_info().context("not a PNG")?;
        let size = reader.output_buffer_size().context("a picture too large")?;
        let mut bytes = vec![0; size];
        let info = reader.next_frame(&mut bytes).context("a broken PNG")?;
        let channels = match info.color_type {
            png::ColorType::Rgb => 3,
            png::ColorType::Rgba => 4,
            other => bail!("a PNG in {other:?}, where RGB or RGBA is expected"),
        };
        let pixels = bytes[..info.buffer_size()].chunks_exact(channels);
        let rgb = pixels.map(|pixel| [pixel[0], pixel[1], pixel[2]]).collect();
        Ok(Picture { width: info.width, height: info.height, rgb })
    }

    /// Encodes a PNG, preferring speed over size.
    pub fn encode(&self) -> Result<Vec<u8>> {
        let mut out = Vec::new();
        let mut encoder = png::Encoder::new(&mut out, self.width, self.height);
        encoder.set_color(png::ColorType::Rgb);
        encoder.set_depth(png::BitDepth::Eight);
        encoder.set_compression(png::Compression::High);
        let mut writer = encoder.write_header()?;
        writer.write_image_data(self.rgb.as_flattened())?;
        writer.finish()?;
        Ok(out)
    }

    /// Reads a PNG file.
    pub fn load(path: &Path) -> Result<Picture> {
        let bytes = fs::read(path).with_context(|| format!("cannot read {}", path.display()))?;
        Picture::decode(&bytes).with_context(|| path.display().to_string())
    }

    /// Writes a PNG file, creating its parent directories.
    pub fn save(&self, path: &Path) -> Result<()> {
        if let Some(dir) = path.parent() {
            fs::create_dir_all(dir)?;
        }
        let bytes = self.encode()?;
        fs::write(path, bytes).with_context(|| format!("cannot write {}", path.display()))
    }

    /// The pixel at a point. The point is clamped to the picture.
    pub fn pixel(&self, x: f64, y: f64) -> [u8; 3] {
        let column = (x.max(0.0) as u32).min(self.width - 1);
        let row = (y.max(0.0) as u32).min(self.height - 1);
        self.rgb[(row * self.width + column) as usize]
    }

    /// Number of pixels that satisfy `test` within `radius` of a point.
    pub fn count_near(&self, x: f64, y: f64, radius: f64, test: impl Fn([u8; 3]) -> bool) -> usize {
        let mut count = 0;
        for (index, pixel) in self.rgb.iter().enumerate() {
            let column = (index as u32 % self.width) as f64 + 0.5;
            let row = (index as u32 / self.width) as f64 + 0.5;
            let near = (column - x).powi(2) + (row - y).powi(2) <= radius * radius;
            count += usize::from(near && test(*pixel));
        }
        count
    }

    /// Number of distinct colours; an empty picture counts as one.
    pub fn colors(&self) -> usize {
        let mut colors = self.rgb.clone();
        colors.sort_unstable();
        colors.dedup();
        colors.len()
    }

    /// Compares with a picture of the same size. Pixels that differ by more than `tolerance` are outliers.
    pub fn compare(&self, other: &Picture, tolerance: u8) -> Result<Difference> {
        if (self.width, self.height) != (other.width, other.height) {
            bail!(
                "a picture of {} x {} where {} x {} is expected",
                self.width,
                self.height,
                other.width,
                other.height
            );
        }
        let (mut sum, mut max, mut outliers) = (0_u64, 0, 0);
        for (left, right) in self.rgb.iter().zip(&other.rgb) {
            let apart = [0, 1, 2].map(|channel| left[channel].abs_diff(right[channel]));
            sum += apart.iter().map(|&apart| u64::from(apart)).sum::<u64>();
            let worst = apart.into_iter().max().unwrap_or(0);
            max = max.max(worst);
            outliers += usize::from(worst > tolerance);
        }
        let mean = sum as f64 / (3 * self.rgb.len()).max(1) as f64;
        Ok(Difference { mean, max, outliers })
    }

    /// The difference between two pictures, brightened so that it is visible.
    pub fn difference(&self, other: &Picture) -> Picture {
        let rgb = self.rgb.iter().zip(&other.rgb);
        let rgb = rgb
            .map(|(l, r)| {
                [0, 1, 2].map(|channel| l[channel].abs_diff(r[channel]).saturating_mul(8))
            })
            .collect();
        Picture { width: self.width, height: self.height, rgb }
    }
}
