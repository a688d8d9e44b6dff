// A table of what there is, or what happened, by its columns. Layer: web/ui.

import type { ComponentChildren } from "preact";
import { t } from "../app/language";

export interface LedgerProps {
  label: string;
  /** In English. */
  columns: readonly string[];
  /** What a column says, where its name does not; in English. */
  hints?: Readonly<Record<string, string>>;
  /** Its rows. */
  children: ComponentChildren;
}

/** With its roles said outright: on a narrow screen its rows are laid out as blocks, and browsers would forget them. */
export function Ledger({ label, columns, hints = {}, children }: LedgerProps) {
  return (
    <table class="ledger" role="table" aria-label={label}>
      <thead role="rowgroup">
        <tr role="row">
          {columns.map((column) => (
            <th key={column} role="columnheader" scope="col" title={hints[column] && t(hints[column])}>
              {t(column)}
            </th>
          ))}
        </tr>
      </thead>
      <tbody role="rowgroup">{children}</tbody>
    </table>
  );
}
