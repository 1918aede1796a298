#pragma once

#include <string>

namespace rebounce::bench {

/// Where and from what a figure comes.
struct Machine {
  std::string processor;  ///< model name as the system gives it
  int processor_count = 0;
  std::string compiler;
  std::string build_type;
  std::string commit;  ///< of the source tree; ends in "-modified" if it differed from it
};

Machine describe_machine();

}  // namespace rebounce::bench
