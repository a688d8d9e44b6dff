// What fails in one part of a board leaves the others, and the stop, as they are.
// Layer: web/board.

import { Component } from "preact";
import type { ComponentChildren } from "preact";
import { t } from "../app/language";
import { Failure } from "../ui/failure";

export class Guard extends Component<{ children: ComponentChildren }, { failure: string | null }> {
  override state = { failure: null };

  static override getDerivedStateFromError(error: unknown): { failure: string } {
    return { failure: (error as Error).message };
  }

  override render() {
    if (this.state.failure === null) return this.props.children;
    return (
      <div class="guard">
        <Failure text={this.state.failure} />
        <button class="button" type="button" onClick={() => this.setState({ failure: null })}>
          {t("Try again")}
        </button>
      </div>
    );
  }
}
