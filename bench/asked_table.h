#pragma once

#include <string>

#include "bench/table.h"

namespace rebounce::bench {

/// Rows of what was measured of form factors beside what is asked of them.
class AskedTable {
 public:
  /// At most `asked` is wanted; 0: nothing is.
  void at_most(const std::string& subject, std::size_t patches, const char* quality,
               const std::string& measure, double value, double asked);

  void at_least(const std::string& subject, std::size_t patches, const char* quality,
                const std::string& measure, double value, double asked);

  const Table& table() const { return table_; }

 private:
  Table table_ = Table({"subject", "patches", "quality", "measure", "value", "asked", "of asked"});
};

}  // namespace rebounce::bench
