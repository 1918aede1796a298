// bench_first_frames: whether any of the first frames of a process takes much longer than the rest.

#include <fmt/format.h>
#include <omp.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <exception>
#include <string>
#include <vector>

#include "bench/support/input.h"
#include "bench/support/program.h"
#include "bench/support/timing.h"
#include "rebounce/engine.h"
#include "rebounce/error.h"
#include "rebounce/transfer_file.h"
#include "runtime/rays/box.h"
#include "transfer/file/transfer_data.h"

namespace rebounce::bench {
namespace {

constexpr int kFrames = 100;
constexpr int kFirstCounted = 2;   // the two before warm caches up
constexpr double kMuchLonger = 3;  // times the median

using FrameSeconds = std::array<double, kFrames>;

/// Two lamps on circles below the ceiling, in one frame of many.
std::array<Light, 2> lamps_at(int frame, const Box& box) {
  std::array<Light, 2> lamps;
  const glm::vec3 middle = 0.5F * (box.low + box.high), size = box.extent();
  for (std::size_t k = 0; k < lamps.size(); ++k) {
    const float angle = 0.1F * static_cast<float>(frame) + 3 * static_cast<float>(k);
    lamps[k].position = {middle.x + 0.2F * size.x * std::cos(angle), box.low.y + 0.7F * size.y,
                         middle.z + 0.2F * size.z * std::sin(angle)};
    lamps[k].intensity = 100;
  }
  return lamps;
}

FrameSeconds run_frames(const std::string& file) {
  const auto data = load_transfer(file);
  Engine engine(data);
  const Box box = box_around(data->mesh.position);
  FrameSeconds seconds{};
  for (int frame = 0; frame < kFrames; ++frame) {
    const auto lamps = lamps_at(frame, box);
    seconds[static_cast<std::size_t>(frame)] = seconds_of([&] { engine.relight(lamps, {}); });
  }
  return seconds;
}

/// The same in a process of its own, which begins without threads. Throws Error if it fails.
FrameSeconds run_process(const std::string& file, int threads) {
  std::array<int, 2> ends{};
  if (pipe(ends.data()) != 0) throw Error("first frames: there is no pipe left");
  const pid_t child = fork();
  if (child < 0) throw Error("first frames: there is no process left");
  if (child == 0) {
    omp_set_num_threads(threads);
    try {
      const FrameSeconds seconds = run_frames(file);
      const bool sent = write(ends[1], seconds.data(), sizeof(seconds)) == sizeof(seconds);
      _exit(sent ? 0 : 1);
    } catch (const std::exception& error) {
      fmt::print(stderr, "{}\n", error.what());
      _exit(1);
    }
  }
  close(ends[1]);
  FrameSeconds seconds{};
  const bool got = read(ends[0], seconds.data(), sizeof(seconds)) == sizeof(seconds);
  close(ends[0]);
  int status = 0;
  waitpid(child, &status, 0);
  if (!got || status != 0) throw Error("first frames: the process with " + file + " failed");
  return seconds;
}

void run(const std::vector<std::string>& files, const CommonOptions& options) {
  Table table({"file", "threads", "run", "median us", "first us", "second us",
               "slowest of the rest us", "above three medians"});
  for (const std::string& file : files) {
    run_at_thread_counts(options, [&](int threads) {
      for (int k = 0; k < options.repeats; ++k) {
        const FrameSeconds seconds = run_process(file, threads);
        const std::vector<double> rest(seconds.begin() + kFirstCounted, seconds.end());
        const double median = summarise(rest).median;
        const auto slow =
            std::ranges::count_if(rest, [&](double frame) { return frame > kMuchLonger * median; });
        table.add({scene_name(file), threads, k, 1e6 * median, 1e6 * seconds[0], 1e6 * seconds[1],
                   1e6 * std::ranges::max(rest), slow});
      }
    });
  }
  publish("bench_first_frames", table, options);
}

}  // namespace
}  // namespace rebounce::bench

int main(int argc, char** argv) {
  std::vector<std::string> files;
  rebounce::bench::CommonOptions options{.repeats = 20};
  CLI::App app("Times the first 100 frames of a process, each with two moved lamps, in many runs.",
               "bench_first_frames");
  app.add_option("files", files, "Transfer files")->required();
  add_common_options(app, options);
  return rebounce::bench::run_program(app, argc, argv, options,
                                      [&] { rebounce::bench::run(files, options); });
}
