#pragma once

#include <cstddef>
#include <cstdint>
#include <limits>

#include "rebounce/error.h"
#include "transfer/base/grouped.h"

namespace rebounce {

using LinksByNode = Grouped<std::uint64_t>;

/// The links of each node. A link is listed at both of its nodes. `ends`(k) returns the two nodes
/// of link k as an array. Throws Error if there are more links than 32 bits number.
template <typename Ends>
LinksByNode links_by_node(std::size_t node_count, std::size_t link_count, const Ends& ends) {
  if (link_count > std::numeric_limits<std::uint32_t>::max()) {
    throw Error("links: more than 4294967295 cannot be used; ask for fewer patches");
  }
  return {node_count, [&](const auto& add) {
            for (std::uint32_t k = 0; k < link_count; ++k) {
              const auto [a, b] = ends(k);
              add(a, k);
              if (a != b) add(b, k);
            }
          }};
}

}  // namespace rebounce
