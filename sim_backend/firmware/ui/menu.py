"""The menus of the user interface as far as telegrams can observe them: the effects of keys.

Pictures and texts are LEGO's and are not drawn. Below the second level only the depth is followed, but for programs,
the choice of values for the data log, and the pages of radio, volume and sleep. Source: docs/firmware.md section 8.5.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial

from sim_backend.firmware.files.loader import Loader
from sim_backend.firmware.radio import Radio
from sim_backend.firmware.screen_refresh import ScreenRefresh
from sim_backend.firmware.ui import log_menu
from sim_backend.firmware.ui import menu_drawing as drawing
from sim_backend.firmware.ui import menu_places as places
from sim_backend.firmware.ui import screen_marks as marks
from sim_backend.firmware.ui.key_input import KeyInput
from sim_backend.firmware.ui.key_states import KeyStates, Pass
from sim_backend.firmware.ui.keys import Key
from sim_backend.firmware.ui.log_menu import LogMenu
from sim_backend.firmware.ui.menu_files import MenuFiles
from sim_backend.firmware.ui.menu_message import MenuMessage
from sim_backend.firmware.ui.menu_places import Places
from sim_backend.firmware.ui.menu_radio import MenuRadio
from sim_backend.firmware.ui.menu_settings import MenuSettings
from sim_backend.firmware.ui.menu_steps import MenuSteps
from sim_backend.firmware.ui.program_steps import PROGRAM, ProgramSteps
from sim_backend.firmware.ui.registers import UiRegisters
from sim_backend.firmware.ui.screen_marks import NOTHING, Marks
from sim_backend.firmware.ui.sensor_view import SensorView
from sim_backend.firmware.ui.states import KEY_STATES, Place, UiState


class Menu:
    """The place in the menus.

    Args:
        registers: Holds the volume that is in use, and the flags.
        keys: The keys.
        settings: Settings that the menus change.
        loader: Holds the files.
        screen: Draws the menus.
        view: The value of a sensor or motor that is shown.
        logs: The data log.
        program: The program that is made on the brick.
        radio: The radio that the menus change.
        has_log: Whether the main menu has an item for it.

    Attributes:
        states: The states of the last key.
        switches_off: Whether the last key switches the brick off.
        runs: Name of the file that it runs, if any.
        files: The lists of files.
        message: What is shown until a key is pressed.
        program: The program that is made on the brick.
        naming: The page where it gets a name.
    """

    def __init__(
        self,
        registers: UiRegisters,
        keys: KeyInput,
        settings: MenuSettings,
        loader: Loader,
        screen: ScreenRefresh,
        view: SensorView,
        logs: LogMenu,
        program: ProgramSteps,
        radio: Radio,
        *,
        has_log: bool,
    ) -> None:
        self._registers, self._settings, self._screen = registers, settings, screen
        self.switches_off = False
        self.runs: str | None = None
        self.program, self.view, self.logs = program, view, logs
        self._places = Places(loader.flash.names_ending, self.program, self.view, radio, logs if has_log else None)
        self.states = KeyStates(registers, screen)
        self.files = MenuFiles(
            loader, settings.stored, self._places, self.states, leave=self._leave_list, sounds=program.waits
        )
        self._radio = MenuRadio(keys, radio, self.states)
        self.message = MenuMessage(logs, self.states)
        self._steps = MenuSteps(program, self.states, self._leave_program)
        self.naming = self._steps.naming
        self.reset()

    def reset(self) -> None:
        """Go to the first item of the main menu; a data log that runs stays open, and a sensor keeps its type."""
        self._place, self.runs = [0], None
        self.view.shown = self.logs.log.runs = False
        self.message.drop()
        self.naming.drop()
        self._confirms: bool | None = None
        self._volume = self._registers.volume

    def show_file(self, name: str) -> None:
        """Go to the page of the file that was started, or up from it to the list if the question was shown."""
        self.view.chosen, self.view.shown, self.runs = False, False, None
        self._place, asked, self._confirms, self.files.chosen = [*places.PROGRAMS, 0, 0], self._confirms, None, name
        if asked:
            self._place.pop()

    def show_page(self) -> None:
        """Show the page again of the file that was started there."""
        self.states.begin(drawn=marks.PAGE)
        self.runs = None

    def redraw(self) -> None:
        """Draw the page after a file from state DRAWING on."""
        self.states.begin(UiState.DRAWING)
        self.runs = None
        if places.is_list(tuple(self._place[:-1])):
            self._show_files()
        else:
            self.states.draw_last(*drawing.FILE_PAGE)

    def go_on_from(self, state: int) -> None:
        """Continue from a state that was written to the map: one of a key, or one before the page is drawn."""
        self._drop_question()
        keys = {shown: key for key, shown in KEY_STATES.items()}
        if self.naming.active and state not in (UiState.MELODY, UiState.ENTRY):
            self.naming.go_on(*[UiState.MENU][: state in keys])
            return
        if self.runs is not None and state not in (UiState.MELODY, UiState.ENTRY):  # it is run once more
            self.states.begin(*(each for each in (UiState.MENU, UiState.DRAWING) if state in keys or each > state))
            return
        if state in keys and not self.view.shown:
            self.press(keys[UiState(state)])
            del self.states.left[0]
            return
        if state in (UiState.MELODY, UiState.ENTRY):
            self.reset()
            self.view.chosen = False
        drawn = NOTHING if self.view.shown else self._page
        self.view.chosen, self.view.shown = self.view.chosen or self.view.shown, False  # a value is shown again
        last = UiState.ENTRY if state in keys else state
        later = [each for each in (UiState.ENTRY, UiState.MENU, UiState.DRAWING) if each > last]
        self.runs = None
        self.states.begin(*later, drawn=marks.ENTRY if state == UiState.MELODY else NOTHING if later else drawn)
        if later:
            self.states.draw_last(drawn)

    @property
    def shows_value(self) -> bool:
        """Whether the value of a sensor or motor is shown, until exit is pressed."""
        return self.view.shown and not self.states.shown and self._registers.state == UiState.DRAWING

    @property
    def has_page(self) -> bool:
        """Whether a value is shown, or a file runs or is about to, whatever state was written meanwhile."""
        return self.runs is not None or self.view.shown

    @property
    def begins(self) -> bool:
        """Whether the next step runs a file, shows a value or starts a log, which comes before a request for a file."""
        return self._ends_in_page and self.states.shown and not self.states.left

    @property
    def _ends_in_page(self) -> bool:
        """Whether the states of a key end in a file that is run, a value that is shown, or a log that is started."""
        return self.runs is not None or self.view.chosen or self.logs.begins

    def press(self, key: int) -> None:
        """Follow a key, a value of `Key`; other values do nothing."""
        stays = tuple(self._place[:-1]) == log_menu.START and self._registers.state != UiState.EXIT
        if key not in KEY_STATES or (key == Key.EXIT and stays):
            return
        if self.has_page:  # state WAITING was written
            self.go_on_from(KEY_STATES[key])
            self.states.left.insert(0, Pass(KEY_STATES[key]))
            return
        if self.naming.shown:
            if self._registers.state == UiState.DRAWING:
                self.naming.press(key)
            else:
                self.naming.go_on(KEY_STATES[key], UiState.MENU)
            return
        self.states.begin()
        self.runs = None
        self.states.show(KEY_STATES[key])
        if self._confirms is not None:
            self._answer(key)
        elif key in (Key.LEFT, Key.RIGHT):
            self._move(1 if key == Key.RIGHT else -1)
        elif key == Key.EXIT:
            self._leave()
        else:
            self._enter()
        if not (self._ends_in_page or self.switches_off or self.message.has_version or self.states.draws):
            self.states.draw_last(self._page)

    @property
    def _page(self) -> Marks:
        """The drawing at the end of a key's states."""
        place = tuple(self._place)
        return drawing.page(place, makes_program=self._steps.has(place[:-1]))

    def interrupt(self) -> None:
        """Finish the current state, and drop the states to come: a file is started, whose page follows."""
        self.states.finish()
        self.drop()

    def _drop_question(self) -> None:
        """Drop the question whether to switch off, in the pass after exit: it only appears in the next pass."""
        if self.states.shown and self.states.state == UiState.EXIT:
            self._confirms = None

    def drop(self) -> None:
        """Drop the states to come and what they draw: another state was written to the map."""
        self._drop_question()
        self.states.drop()
        self.message.drop()
        self.naming.drop()
        self.logs.begins = False

    def _answer(self, key: int) -> None:
        """Answer whether to switch off."""
        if key in (Key.LEFT, Key.RIGHT):
            self._confirms = key == Key.LEFT
            return
        self.switches_off = bool(self._confirms) and key == Key.ENTER
        self.reset()
        if self.switches_off:
            del self.states.left[1:]

    def _move(self, step: int) -> None:
        menu = tuple(self._place[:-1])
        if places.asks_to_delete(menu):
            self._place[-1] = places.NO if step > 0 else places.YES
            self.states.draw_last(*drawing.ERASE_ANSWER[: 1 + (menu[:-1] == places.ERASE)])
            return
        items = self.files.shown if places.is_list(menu) else self._places.items(menu)
        self._place[-1] = self._places.next_to(tuple(self._place), step, items)
        if menu == places.VOLUME:
            self.states.act(partial(self._settings.set_volume, self._place[-1]))
        if menu in (places.VOLUME, places.SLEEP):
            self.states.draw_last(marks.BAR, NOTHING)
        elif places.lists_connections(menu):
            self.states.draw_last(drawing.CONNECTIONS[1])
        if places.action(tuple(self._place)) == places.RUN:
            self.states.draw_last(*drawing.FILE_PAGE)
        self._draw_slowly()
        if places.is_list(menu):
            self.files.move(menu, self._place[-1])

    def _leave(self) -> None:
        if len(self._place) == 1:
            self._confirms = True
            return
        if places.asks_to_delete(tuple(self._place[:-1])) and self._place[-1] == places.YES:
            self._place.pop()
        if tuple(self._place[:-1]) == places.VOLUME:
            self.states.act_last(partial(self._settings.set_volume, self._volume))
            self.states.show(UiState.EXIT)
            self._place.pop()
        left, self._place = self._place, self._place[:-1]
        if tuple(self._place) == places.SWITCH:
            self._place.pop()
        menu = tuple(self._place[:-1])
        self._steps.leave(tuple(left))
        if places.is_list(menu):
            self._show_files()
        if tuple(left) == log_menu.START:
            self.states.draw_last(*drawing.OPENED[log_menu.DATA_LOG])
        self._draw_slowly()

    def leave_view(self) -> None:
        """Leave the value of a sensor or motor for the list of items to show."""
        self._screen.mark(marks.LIST)
        if self.view.chosen:
            self.view.set_up()
        self._place = self._place[:-1] or [0]  # a question of the radio has led to the main menu
        self.states.begin()
        self.states.show(UiState.EXIT)
        self.states.draw_last(self._page)
        self._draw_slowly()

    def leave_log(self, message: Sequence[Marks] = ()) -> None:
        """Leave the data log, perhaps by a message."""
        self.states.begin()
        self._place, self.states.left = self.logs.leave(message)

    def _draw_slowly(self) -> bool:
        """Draw an item of the list of items to show, if that takes longer."""
        slow = self.view.is_slow(tuple(self._place))
        if slow:
            self.view.clear()
            self.states.draw_last(marks.PAGE, *drawing.OPENED[places.VALUES])
        return slow

    def _show_files(self) -> None:
        """Show a list after the page of a file."""
        self._place[-1] = 0
        self.files.show_first(tuple(self._place[:-1]))

    def _leave_list(self) -> None:
        """Lead up from a list without files."""
        self._place.pop()
        self.states.left.clear()
        self.states.show(UiState.EXIT)
        self.states.draw_last(self._page)

    def _enter(self) -> None:
        menu, place = tuple(self._place[:-1]), tuple(self._place)
        if menu == places.VOLUME:
            self._volume = place[-1]
            self.states.show(UiState.EXIT)
            self._leave()
            self.states.act(partial(self._settings.store_volume, place[-1]))
        elif menu == places.SLEEP:
            self.states.act(partial(self._settings.store_sleep, self._place.pop()))
            self.states.show(UiState.EXIT)
        elif places.action(place) == places.RUN:
            self.runs = self.files.chosen
        elif places.is_page(menu[:-1]):
            self._place.pop()
            self._answer_page(places.action(menu), place[-1])
        elif self.view.opens(place):
            return
        elif menu == places.ERASE:
            self._place.append(places.NO)
            self.states.draw_last(NOTHING, *drawing.ERASE_ANSWER)
        elif menu[:-1] == places.ERASE:
            self._place.pop()
            if place[-1] == places.YES:
                self.files.erase(self._place.pop())
        elif place == log_menu.START:
            self.logs.begins = True
        elif menu == log_menu.START:
            self._place = [*log_menu.DATA_LOG]
            self.files.keep_log(place[-1])
        elif self.logs.follows(place):
            self._place, self.states.left[-1:] = self.logs.enter(place)
        elif self._steps.follows(place):
            self._place = self._steps.enter(place)
        elif place == places.VERSION:
            self.message.show_version()
        elif self._radio.follows(place):
            self._place = self._radio.enter(place)
        else:
            if place == places.TRY_ME:
                self.states.draw_last(marks.MENU)
                self.states.show(UiState.ENTER)
            self._open(place)

    def _leave_program(self) -> None:
        self._place = [PROGRAM]

    def _answer_page(self, action: int | None, answer: int) -> None:
        """Send a file, or delete it if that is the answer."""
        if action == places.SEND:
            self.files.send()
        elif answer == places.YES:
            self._place.pop()
            self._place[-1] = 0
            self.files.delete(tuple(self._place[:-1]))

    def _open(self, place: Place) -> None:
        first = self._radio.first(place)
        if place == log_menu.DATA_LOG:
            self.logs.clear()
        elif place == places.VALUES:
            self.view.clear()
        elif place == places.VOLUME:
            first = self._volume = self._settings.stored.volume
        elif place == places.SLEEP:
            first = self._settings.stored.sleep
        elif places.is_page(place):
            first = places.first_action(place)
        self._place.append(first)
        if places.is_list(place):
            self.files.enter(place)
        elif places.is_list(place[:-1]):
            page = drawing.FILE_PAGE if places.RUN in places.actions(place) else (NOTHING,)
            self.states.draw_last(NOTHING, *page)
        if place in (places.VOLUME, places.SLEEP):
            self.states.draw_last(marks.PAGE, marks.BAR, NOTHING)
        elif places.lists_connections(place):
            self.states.draw_last(marks.MENU, drawing.CONNECTIONS[0])
        elif self._steps.has(place):
            self._steps.open(place)
        elif place[0] in places.SLOW and not self._draw_slowly():
            self.states.draw_last(*drawing.OPENED.get(place, (NOTHING, NOTHING)))
