#include "bench/asked_table.h"

namespace rebounce::bench {

void AskedTable::at_most(const std::string& subject, std::size_t patches, const char* quality,
                         const std::string& measure, double value, double asked) {
  if (asked <= 0) {
    table_.add({subject, patches, quality, measure, value, {}, {}});
  } else {
    table_.add({subject, patches, quality, measure, value, asked, value / asked});
  }
}

void AskedTable::at_least(const std::string& subject, std::size_t patches, const char* quality,
                          const std::string& measure, double value, double asked) {
  table_.add({subject, patches, quality, measure, value, asked, asked / value});
}

}  // namespace rebounce::bench
