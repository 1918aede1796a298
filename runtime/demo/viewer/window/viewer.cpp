#include "runtime/demo/viewer/window/viewer.h"

#include <backends/imgui_impl_opengl3.h>
#include <imgui.h>

#include <algorithm>
#include <vector>

#include "rebounce/error.h"
#include "runtime/demo/viewer/gl/headless_context.h"
#include "runtime/demo/viewer/gl/render_targets.h"
#include "runtime/demo/viewer/window/controls.h"
#include "runtime/demo/viewer/window/frame_drawer.h"
#include "runtime/demo/viewer/window/panels.h"
#include "runtime/demo/viewer/window/window.h"

namespace rebounce {
namespace {

// Dear ImGui without a window, for pictures with panels.
class HeadlessPanels {
 public:
  HeadlessPanels(int width, int height) {
    ImGui::CreateContext();
    ImGuiIO& io = ImGui::GetIO();
    io.IniFilename = nullptr;
    io.DisplaySize = {static_cast<float>(width), static_cast<float>(height)};
    ImGui_ImplOpenGL3_Init("#version 330 core");
  }
  ~HeadlessPanels() {
    ImGui_ImplOpenGL3_Shutdown();
    ImGui::DestroyContext();
  }
  HeadlessPanels(const HeadlessPanels&) = delete;
  HeadlessPanels& operator=(const HeadlessPanels&) = delete;

  void draw(Panels& panels, const Controls& controls, ViewerState& state,
            const FrameDrawer& drawer) {
    ImGui_ImplOpenGL3_NewFrame();
    ImGui::NewFrame();
    controls.draw_handles(state);
    panels.draw(state, drawer);
    ImGui::Render();
    ImGui_ImplOpenGL3_RenderDrawData(ImGui::GetDrawData());
  }
};

double median(std::vector<double> values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::ranges::nth_element(values, middle);
  return *middle;
}

StageTimes median(const std::vector<StageTimes>& times) {
  const auto of = [&](auto&& part) {
    std::vector<double> values;
    for (const StageTimes& t : times) values.push_back(part(t));
    return median(std::move(values));
  };
  StageTimes middle;
  middle.direct = of([](const StageTimes& t) { return t.direct; });
  for (std::size_t k = 0; k < middle.solve.size(); ++k) {
    middle.solve[k] = of([k](const StageTimes& t) { return t.solve[k]; });
  }
  middle.upload = of([](const StageTimes& t) { return t.upload; });
  middle.shadows = of([](const StageTimes& t) { return t.shadows; });
  middle.draw = of([](const StageTimes& t) { return t.draw; });
  middle.card = times.back().card;
  for (std::size_t k = 0; k < middle.card.size(); ++k) {
    middle.card[k].microseconds =
        of([k](const StageTimes& t) { return k < t.card.size() ? t.card[k].microseconds : 0; });
  }
  return middle;
}

ViewerState begin(const ViewerSetup& setup) {
  ViewerState state(setup);
  state.exposure = setup.exposure.value_or(0);
  state.wants_exposure = !setup.exposure;
  return state;
}

}  // namespace

void run_viewer(const std::shared_ptr<const TransferData>& data, const ViewerSetup& setup,
                const std::function<bool()>& keep_open) {
  Window window(setup.width, setup.height, setup.title);
  FrameDrawer drawer(data, setup);
  Controls controls(drawer.scene(), drawer.bounds());
  Panels panels;
  ViewerState state = begin(setup);
  state.draws_emitter_lamps = !window.draws_on_processor();
  while (keep_open() && window.begin_frame()) {
    controls.update(state);
    if (state.playing) state.time += ImGui::GetIO().DeltaTime;
    // A minimised window has no pixels.
    if (window.width() > 0 && window.height() > 0) {
      drawer.draw(state, window.width(), window.height(), 0);
    }
    controls.draw_menu(state);
    if (state.shows_panels) {
      controls.draw_handles(state);
      panels.draw(state, drawer);
    }
    window.end_frame();
  }
}

StageTimes draw_viewer_frames(const std::shared_ptr<const TransferData>& data,
                              const ViewerSetup& setup, int frame_count, float frames_per_second,
                              const std::function<void(int, const ScreenImage&)>& take) {
  if (frame_count < 1) throw Error("the viewer was asked for no frame; ask for at least one");
  const HeadlessContext context;
  FrameDrawer drawer(data, setup);
  const Controls controls(drawer.scene(), drawer.bounds());
  Panels panels;
  std::optional<HeadlessPanels> overlay;
  if (setup.panels) overlay.emplace(setup.width, setup.height);
  const OffscreenTarget target(setup.width, setup.height);
  ViewerState state = begin(setup);
  std::vector<StageTimes> times;
  for (int frame = 0; frame < frame_count; ++frame) {
    state.time = static_cast<float>(frame) / frames_per_second;
    drawer.draw(state, setup.width, setup.height, target.framebuffer());
    if (!drawer.card_refusal().empty()) throw Error(drawer.card_refusal());
    times.push_back(drawer.times());
    if (overlay) overlay->draw(panels, controls, state, drawer);
    take(frame, target.read());
  }
  return median(times);
}

}  // namespace rebounce
