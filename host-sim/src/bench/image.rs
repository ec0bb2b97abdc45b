//! What an image takes: section headers of a 32-bit little-endian ELF file (System V ABI, chapter 4).

/// Sizes of an image, and what made it.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct ImageSize {
    /// Bytes that are loaded: code, constants, initial values.
    pub flash: u32,
    /// Bytes of static variables.
    pub ram: u32,
    /// Compilers named in `.comment`.
    pub compiler: String,
}

/// First address of RAM on the STM32F4 (RM0090, memory map).
const RAM_START: u32 = 0x2000_0000;
/// Section occupies memory while running.
const ALLOCATED: u32 = 2;
/// Section has no bytes in the file.
const NO_BITS: u32 = 8;

/// Reads the sizes; `None` if `elf` is not such a file.
#[must_use]
pub fn size(elf: &[u8]) -> Option<ImageSize> {
    // Magic, 32 bits, little-endian.
    if elf.get(..6)? != b"\x7fELF\x01\x01" {
        return None;
    }
    let table = u32_at(elf, 32)? as usize;
    let (entry, count) = (u16_at(elf, 46)?, u16_at(elf, 48)?);
    let mut size = ImageSize::default();
    for i in 0..usize::from(count) {
        let at = table.checked_add(i * usize::from(entry))?;
        let field = |k: usize| u32_at(elf, at.checked_add(4 * k)?);
        let (kind, flags, address) = (field(1)?, field(2)?, field(3)?);
        let (offset, length) = (field(4)? as usize, field(5)?);
        if flags & ALLOCATED != 0 {
            if address >= RAM_START {
                size.ram = size.ram.checked_add(length)?;
            }
            if kind != NO_BITS {
                size.flash = size.flash.checked_add(length)?;
            }
        } else if size.compiler.is_empty() && kind != NO_BITS {
            let bytes = elf.get(offset..offset.checked_add(length as usize)?)?;
            size.compiler = rustc(bytes).unwrap_or_default();
        }
    }
    Some(size)
}

/// The zero-terminated text that names the compiler, if `bytes` begin like a `.comment` section.
fn rustc(bytes: &[u8]) -> Option<String> {
    const NAME: &[u8] = b"rustc version ";
    let start = bytes
        .get(..bytes.len().min(512))?
        .windows(NAME.len())
        .position(|window| window == NAME)?;
    let text = bytes[start..].split(|&b| b == 0).next()?;
    String::from_utf8(text.to_vec()).ok()
}

fn u16_at(bytes: &[u8], at: usize) -> Option<u16> {
    Some(u16::from_le_bytes(
        bytes.get(at..at.checked_add(2)?)?.try_into().ok()?,
    ))
}

fn u32_at(bytes: &[u8], at: usize) -> Option<u32> {
    Some(u32::from_le_bytes(
        bytes.get(at..at.checked_add(4)?)?.try_into().ok()?,
    ))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A file of sections only: (kind, flags, address, bytes).
    fn elf(sections: &[(u32, u32, u32, u32)]) -> Vec<u8> {
        let mut file = vec![0; 52];
        file[..6].copy_from_slice(b"\x7fELF\x01\x01");
        file[32..36].copy_from_slice(&52_u32.to_le_bytes());
        file[46..48].copy_from_slice(&40_u16.to_le_bytes());
        file[48..50].copy_from_slice(&(sections.len() as u16).to_le_bytes());
        for &(kind, flags, address, length) in sections {
            for word in [0, kind, flags, address, 0, length, 0, 0, 0, 0] {
                file.extend_from_slice(&word.to_le_bytes());
            }
        }
        file
    }

    #[test]
    fn code_counts_as_flash_zeroed_data_as_ram_and_initial_values_as_both() {
        let file = elf(&[
            (1, 6, 0x0800_0000, 1000),
            (1, 3, 0x2000_0000, 20),
            (8, 3, 0x2000_0014, 300),
            (1, 0, 0, 0),
        ]);
        let size = size(&file).unwrap();
        assert_eq!((size.flash, size.ram), (1020, 320));
    }

    #[test]
    fn other_files_have_no_size() {
        let good = elf(&[(1, 6, 0, 1)]);
        for bytes in [&b""[..], b"\x7fELF", b"not an image at all", &good[..60]] {
            assert_eq!(size(bytes), None);
        }
        assert_eq!(
            rustc(b"Linker: LLD\0rustc version 1.88.0 (x)\0").as_deref(),
            Some("rustc version 1.88.0 (x)")
        );
    }
}
