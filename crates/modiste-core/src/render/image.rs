//! Finished pictures.

/// Space between the tiles of a contact sheet (pixels).
const GUTTER: usize = 6;

/// A picture: 8-bit sRGB, rows from the top.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Image {
    /// Width (pixels).
    pub width: usize,
    /// Height (pixels).
    pub height: usize,
    /// `height` × `width` × 3 bytes.
    pub rgb: Vec<u8>,
}

impl Image {
    /// A picture of one colour.
    pub fn filled(width: usize, height: usize, colour: [u8; 3]) -> Self {
        Self { width, height, rgb: colour.repeat(width * height) }
    }

    /// The colour of a pixel inside the picture.
    pub fn pixel(&self, x: usize, y: usize) -> [u8; 3] {
        let at = 3 * (y * self.width + x);
        [self.rgb[at], self.rgb[at + 1], self.rgb[at + 2]]
    }

    /// Sets a pixel; outside the picture nothing happens.
    pub fn set_pixel(&mut self, x: usize, y: usize, colour: [u8; 3]) {
        if x < self.width && y < self.height {
            let at = 3 * (y * self.width + x);
            self.rgb[at..at + 3].copy_from_slice(&colour);
        }
    }

    /// Copies `tile` with its upper left corner at (`left`, `top`); what does not fit is cut off.
    pub fn paste(&mut self, tile: &Self, left: usize, top: usize) {
        let columns = tile.width.min(self.width.saturating_sub(left));
        for row in 0..tile.height.min(self.height.saturating_sub(top)) {
            let from = 3 * row * tile.width;
            let to = 3 * ((top + row) * self.width + left);
            self.rgb[to..to + 3 * columns].copy_from_slice(&tile.rgb[from..from + 3 * columns]);
        }
    }
}

/// Lays pictures out in rows of `columns`, in reading order, each in a cell as large as the largest.
pub fn contact_sheet(tiles: &[Image], columns: usize) -> Image {
    let columns = columns.clamp(1, tiles.len().max(1));
    let rows = tiles.len().div_ceil(columns);
    let cell_width = tiles.iter().map(|tile| tile.width).max().unwrap_or(0);
    let cell_height = tiles.iter().map(|tile| tile.height).max().unwrap_or(0);
    let mut sheet =
        Image::filled(columns * (cell_width + GUTTER) + GUTTER, rows * (cell_height + GUTTER) + GUTTER, [255; 3]);
    for (index, tile) in tiles.iter().enumerate() {
        let (row, column) = (index / columns, index % columns);
        sheet.paste(tile, GUTTER + column * (cell_width + GUTTER), GUTTER + row * (cell_height + GUTTER));
    }
    sheet
}
