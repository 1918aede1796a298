#pragma once

#include <cstddef>
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

/// Seconds that all threads of this process have had a processor: what others on the machine
/// disturb less than the time that passes.
double processor_seconds();

}  // namespace rebounce::bench
