#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "precompute/import/gltf_document.h"

namespace rebounce::gltf {

/// The elements of an accessor as floating point.
struct FloatElements {
  std::size_t count = 0;
  std::size_t component_count = 0;  ///< 1 to 4
  bool was_integer = false;         ///< stored as integers that are not normalised
  std::vector<float> value;         ///< [count][component_count]

  /// Component `component` of element `element`, both in range.
  float at(std::size_t element, std::size_t component) const {
    return value[element * component_count + component];
  }
};

/// Reads a scalar or vector accessor of floats or of 8 or 16-bit integers (normalised ones become
/// [0, 1] or [-1, 1], glTF 2.0 section 3.11): tightly packed or with a stride, sparse, or without
/// data (zeros). `accessor` is an index in range. Throws Error, which names the accessor, for any
/// other component type, and if a byte lies outside its buffer view.
FloatElements read_floats(const Document& document, int accessor);

/// The number of components of an accessor's type. Throws Error for a matrix.
std::size_t component_count(int type);

/// Converts tightly packed elements of the type, component type and normalisation of `accessor`, in
/// the same way.
FloatElements unpack_floats(const tinygltf::Accessor& accessor,
                            const std::vector<std::uint8_t>& packed);

/// Reads an accessor of unsigned scalars, in the same way.
std::vector<std::uint32_t> read_indices(const Document& document, int accessor);

}  // namespace rebounce::gltf
