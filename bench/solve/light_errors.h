#pragma once

#include <cstdint>
#include <string>

#include "bench/support/table.h"
#include "transfer/file/transfer_data.h"

namespace rebounce::bench {

struct LightErrorSettings {
  int light_count = 1000;     ///< of each kind
  std::uint64_t seed = 4711;  ///< none that operators are built or checked with
  /// The truth by conjugate gradients alone, without an inverse: many times slower.
  bool iterate = false;
  /// Transfer file of the same patches, whose form factors give the truth instead of those that the
  /// operator was made from; empty: none.
  std::string truth;
  std::string each;  ///< CSV file for a row of every light; empty: none
};

Table make_light_error_table();

/// A row for each light: its error, how much of it arrives (LightError), and on how many patches
/// its flux is, as the squared sum over the sum of squares.
Table make_single_light_table();

/// Adds a row for each kind of light: the errors of the operator of `data` under fresh lights,
/// beside the bounds on record and what the file says of its error against all pairs, and to
/// `single` one for each light. The truth is that of the form factors of `data`, which are to be
/// those that the operator was made from, or of another file: of pairs by a dense inverse of their
/// own, of compressed form factors by many solves side by side, which are many times faster and are
/// themselves held against conjugate gradients. Throws Error if the other file has other patches.
void measure_light_errors(const TransferData& data, const LightErrorSettings& settings,
                          Table& table, Table& single);

}  // namespace rebounce::bench
